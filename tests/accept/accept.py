#!/usr/bin/env python3
"""Score host_sim's records and traces against the truth, and compare with the limits.

accept.py DATA_DIR WORK_DIR

WORK_DIR, made by accept.sh: PART/NAME/records (host_sim --json --paper), PART/trace/NAME/*.json
(--trace) and PART/table (what host_sim itself prints) for PART dots and range, and
full/PART/NAME/records (host_sim --json, everything switched on). Nothing is taken from
the program's own score: the rules are docs/contract.md's, "Score", written once more; at the end the
two are compared. Exit status 1 when a limit is missed or the two scores differ.

Dots, per sequence: recall is the fraction of truth's visible dots with a detected dot within 1.5 px; the
centre error is the median distance to it. A label is right when truth has that dot and the labelled
dot lies within 1.5 px of it; a label of a dot that truth does not have is wrong.
"""

import collections
import json
import os
import re
import statistics
import sys

import numpy as np

MATCH_MM = 100.0
NEAR_PX = 1.5
TABLE_NEAR_PX = 2.0  # the program's own table, see sim_score.h
RENDERED = ("paper_s1_6", "paper_s1_7", "paper_s2_2", "paper_s2_5", "wide_s1_7", "wide_s2_2")
OVEREXPOSED = ("paper_s1_7", "wide_s1_7")
OUTCOMES = ("correct", "ambiguous", "wrong", "not done")


def read_lines(path):
    with open(path, encoding="utf-8") as file:
        return [json.loads(line) for line in file if line.strip()]


# --- heads ---------------------------------------------------------------------------------------


def matches(hypothesis, centre_mm):
    return np.linalg.norm(np.subtract(hypothesis["centre_mm"], centre_mm)) <= MATCH_MM


def outcome(record, centre_mm):
    """One of OUTCOMES; centre_mm None: nobody is there."""
    heads = [record["hypotheses"][i] for i in record["heads"]]
    if not heads:
        return "not done"
    if centre_mm is None or not any(matches(h, centre_mm) for h in heads):
        return "wrong"
    return "correct" if len(heads) == 1 else "ambiguous"


class Heads:
    """Counts of a sequence; with: frames with a head, empty: those without."""

    def __init__(self):
        self.frames = collections.Counter()
        self.outcomes = {True: collections.Counter(), False: collections.Counter()}
        self.detected = 0
        self.selected = collections.Counter()
        self.errors_mm = []
        self.several = self.several_found = 0  # heads of frames whose truth has several

    def add(self, record, truth):
        for head in truth.get("heads", []):
            self.several += 1
            self.several_found += any(matches(record["hypotheses"][i], head["centre_mm"])
                                      for i in record["heads"])
        if "head" not in truth:
            return
        centre_mm = truth["head"] and truth["head"]["centre_mm"]
        there = centre_mm is not None
        self.frames[there] += 1
        self.outcomes[there][outcome(record, centre_mm)] += 1
        chosen = None if record["head"] is None else record["hypotheses"][record["head"]]
        if there:
            self.detected += any(matches(h, centre_mm) for h in record["hypotheses"])
            self.selected[there] += chosen is not None and matches(chosen, centre_mm)
            if chosen is not None and matches(chosen, centre_mm):
                self.errors_mm.append(np.linalg.norm(np.subtract(chosen["centre_mm"], centre_mm)))
        else:
            self.selected[there] += chosen is None

    @property
    def correct(self):
        return self.outcomes[True]["correct"]

    @property
    def empty_right(self):
        return self.outcomes[False]["not done"]


# --- dots ----------------------------------------------------------------------------------------


class Dots:
    def __init__(self):
        self.true = self.found = self.table_found = self.labels = self.right = self.table_right = 0
        self.errors_px = []

    def add(self, trace, truth):
        true = {int(dot[0]): np.array(dot[1:3]) for dot in truth["dots"]}
        dots = np.column_stack([trace["dots"]["u_px_q12"], trace["dots"]["v_px_q12"]]) / 4096.0
        self.true += len(true)
        for position in true.values():
            distance = np.hypot(*(dots - position).T).min() if len(dots) else np.inf
            self.table_found += distance <= TABLE_NEAR_PX
            if distance <= NEAR_PX:
                self.found += 1
                self.errors_px.append(distance)
        for slot, label in enumerate(trace["labels"]["slot"]):
            if label is not None:
                self.labels += 1
                off = np.hypot(*(dots[label["dot"]] - true[slot])) if slot in true else np.inf
                self.right += off <= NEAR_PX
                self.table_right += off <= TABLE_NEAR_PX

    @property
    def recall(self):
        return self.found / self.true

    @property
    def median_px(self):
        return statistics.median(self.errors_px)


# --- everything ----------------------------------------------------------------------------------


def score_heads(data, work, part):
    """Heads of each sequence of a part, by name."""
    heads = {}
    for name in sorted(os.listdir(os.path.join(data, part))):
        path = os.path.join(work, part, name, "records")
        if not os.path.exists(path):
            continue
        truths = {t["file"]: t for t in read_lines(os.path.join(data, part, name, "truth.jsonl"))}
        heads[name] = Heads()
        for record in read_lines(path):
            heads[name].add(record, truths[record["file"]])
    return heads


def score(data, work, part):
    """(heads, dots) of each sequence of a part, by name."""
    heads, dots = {}, {}
    for name in sorted(os.listdir(os.path.join(data, part))):
        records_path = os.path.join(work, part, name, "records")
        if not os.path.exists(records_path):
            continue
        truths = {t["file"]: t for t in read_lines(os.path.join(data, part, name, "truth.jsonl"))}
        heads[name], dots[name] = Heads(), Dots()
        for record in read_lines(records_path):
            if "error" in record:
                raise SystemExit("accept: %s/%s: %s" % (name, record["file"], record["error"]))
            truth = truths[record["file"]]
            heads[name].add(record, truth)
            if "dots" in truth:
                stem = os.path.splitext(record["file"])[0]
                with open(os.path.join(work, part, "trace", name, stem + ".json"), encoding="utf-8") as f:
                    dots[name].add(json.load(f), truth)
    return heads, {name: d for name, d in dots.items() if d.true}


def limits(dots_heads, dots, range_heads):
    """(what, measured, limit, at least?) of every demand."""
    rendered = [dots_heads[name] for name in RENDERED]
    empty = [h for name, h in dots_heads.items() if name.startswith("real_empty")]
    plain = [name for name in RENDERED if name not in OVEREXPOSED]
    right = {rig: sum(dots[n].right for n in RENDERED if n.startswith(rig))
             / sum(dots[n].labels for n in RENDERED if n.startswith(rig)) for rig in ("paper", "wide")}
    errors_px = [e for name in RENDERED for e in dots[name].errors_px]
    range_empty = [h for name, h in range_heads.items() if name.startswith("neg_")]
    persons = ("real_person_paper", "real_person_wide")
    yield ("rendered: correct, no ambiguity, of %d" % sum(h.frames[True] for h in rendered),
           sum(h.correct for h in rendered), 200, True)
    yield ("rendered: head among the hypotheses, of %d" % sum(h.frames[True] for h in rendered),
           sum(h.detected for h in rendered), 250, True)
    yield ("rendered: empty seats right, of %d" % sum(h.frames[False] for h in rendered),
           sum(h.empty_right for h in rendered), 18, True)
    yield ("dots: mean recall but for seed 7, %", 100 * statistics.mean(dots[n].recall for n in plain), 90.0, True)
    for name in OVEREXPOSED:
        yield ("dots: recall of %s, %%" % name, 100 * dots[name].recall, 62.0, True)
    yield ("dots: median centre error, px", statistics.median(errors_px), 0.16, False)
    yield ("labels right, paper rig, %", 100 * right["paper"], 99.6, True)
    yield ("labels right, wide rig, %", 100 * right["wide"], 96.5, True)
    for name in persons:
        yield ("%s: correct, of 1" % name, dots_heads[name].correct, 1, True)
    yield ("real rooms, dots: empty right, of %d" % sum(h.frames[False] for h in empty),
           sum(h.empty_right for h in empty), 20, True)
    yield ("range: seated person correct, of 1", range_heads["pcl_person_seated"].correct, 1, True)
    yield ("range: empty right, of %d" % sum(h.frames[False] for h in range_empty),
           sum(h.empty_right for h in range_empty), 24, True)


def full_limits(dots_heads, range_heads):
    """The same for everything switched on."""
    rendered = [dots_heads[name] for name in RENDERED]
    empty = [h for name, h in dots_heads.items() if name.startswith("real_empty")]
    range_empty = [h for name, h in range_heads.items() if name.startswith("neg_")]
    errors_mm = sum((h.errors_mm for h in rendered), [])
    people = range_heads["pcl_five_people_standing"]
    yield ("all: rendered, selected right, of %d" % sum(sum(h.frames.values()) for h in rendered),
           sum(sum(h.selected.values()) for h in rendered), 286, True)
    yield ("all: position error, median, mm", statistics.median(errors_mm), 16.0, False)
    yield ("all: position error, 90 %, mm", np.percentile(errors_mm, 90), 32.0, False)
    for name in ("real_person_paper", "real_person_wide"):
        yield ("all: %s, selected right, of 1" % name, dots_heads[name].selected[True], 1, True)
    yield ("all: real rooms, dots: empty right, of %d" % sum(h.frames[False] for h in empty),
           sum(h.selected[False] for h in empty), 28, True)
    yield ("all: range: seated person right, of 1", range_heads["pcl_person_seated"].selected[True], 1, True)
    yield ("all: range: people found, of %d" % people.several, people.several_found, 4, True)
    yield ("all: range: empty right, of %d" % sum(h.frames[False] for h in range_empty),
           sum(h.selected[False] for h in range_empty), 29, True)


def show(value):
    return "%d" % value if isinstance(value, (int, np.integer)) else "%.3f" % value


def print_limits(rows):
    good = True
    print("%-48s %9s %9s" % ("", "measured", "limit"))
    for what, measured, limit, at_least in rows:
        ok = measured >= limit if at_least else measured <= limit
        good = good and ok
        print("%-48s %9s %2s %6s  %s" % (what, show(measured), ">=" if at_least else "<=", show(limit),
                                         "ok" if ok else "NOT OK"))
    return good


def print_sequences(title, heads):
    print("\n%-34s %6s %5s %8s %5s %5s %5s %9s %8s" % (title, "frames", "found", "correct", "amb.", "wrong",
                                                       "none", "empty ok", "error mm"))
    for name, h in heads.items():
        with_head = [h.outcomes[True][o] for o in OUTCOMES]
        error = "%.0f" % statistics.median(h.errors_mm) if h.errors_mm else "-"
        print("%-34s %6d %5d %8d %5d %5d %5d %6d/%-2d %8s"
              % ((name, h.frames[True], h.detected) + tuple(with_head)
                 + (h.empty_right, h.frames[False], error)))


# --- the program's own score ---------------------------------------------------------------------


def own_rows(path):
    """Rows of the program's tables: [(table, label, cells)]; the label of an empty row is its
    directory's."""
    rows, table, label = [], None, None
    with open(path, encoding="utf-8") as file:
        for line in file:
            if line.startswith(("Table 1", "Dots")):
                table, label = line.split()[0], None
            elif table and line.strip() and re.match(r"^\S|^  empty", line):
                name, cells = line[:20].strip(), line[20:].split()
                label = label if name == "empty" else name
                rows.append((table, label, cells))
    return rows


def compare(path, heads, dots):
    """How often the program's tables and this score differ; prints where."""
    rows = own_rows(path)
    differences = 0

    def expect(table, label, cells):
        nonlocal differences
        if (table, label[-20:].strip(), cells) not in [(t, l, c[:len(cells)]) for t, l, c in rows]:
            differences += 1
            print("differs: %s, %s: %s is not in the program's table" % (table, label, " ".join(cells)))

    for name, h in heads.items():
        if h.frames[True]:
            out = h.outcomes[True]
            counts = [h.frames[True], h.detected, h.frames[True] - h.detected, out["correct"],
                      out["ambiguous"], out["wrong"], out["not done"], h.selected[True]]
            expect("Table", name, [str(n) for n in counts])
        if h.frames[False]:
            out = h.outcomes[False]
            expect("Table", name, [str(h.frames[False]), "-", "-", "-", "-", str(out["wrong"]),
                                   str(out["not done"]), str(h.selected[False])])
    for name, d in dots.items():
        found = "%.2f" % (100 * d.table_found / d.true + 1e-9)
        own = [c for t, l, c in rows if t == "Dots" and l == name[-20:].strip()]
        right = "%.2f" % (100 * d.table_right / d.labels)
        if not own or own[0][:2] != [str(d.true), found] or own[0][4:6] != [str(d.labels), right]:
            differences += 1
            print("differs: Dots, %s: %d %s %d %s is not %s" % (name, d.true, found, d.labels, right, own))
    return differences


def main():
    if len(sys.argv) != 3:
        print("usage: accept.py DATA_DIR WORK_DIR", file=sys.stderr)
        return 2
    data, work = sys.argv[1:]
    dots_heads, dots = score(data, work, "dots")
    range_heads, _ = score(data, work, "range")
    full = os.path.join(work, "full")
    full_dots, full_range = score_heads(data, full, "dots"), score_heads(data, full, "range")
    good = print_limits([*limits(dots_heads, dots, range_heads), *full_limits(full_dots, full_range)])
    print_sequences("dots, the paper's method alone", dots_heads)
    print_sequences("range, the paper's method alone", range_heads)
    print_sequences("dots, all", full_dots)
    print_sequences("range, all", full_range)
    print("\n%-34s %8s %7s %9s %8s %7s" % ("dots", "visible", "found", "error px", "labels", "right"))
    for name, d in dots.items():
        print("%-34s %8d %7.2f %9.3f %8d %7.2f" % (name, d.true, 100 * d.recall, d.median_px, d.labels,
                                                   100 * d.right / max(d.labels, 1)))
    differences = compare(os.path.join(work, "dots", "table"), dots_heads, dots)
    differences += compare(os.path.join(work, "range", "table"), range_heads, {})
    print("\nthe program's own tables and this score: %s"
          % ("%d differences" % differences if differences else "agree"))
    return 0 if good and not differences else 1


if __name__ == "__main__":
    sys.exit(main())
