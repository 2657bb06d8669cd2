"""Tables of an evaluation, as Markdown that reads well as plain text too."""

import runs
import scenes
import score


def sum_counts(results, variant, wanted):
    total = score.Counts()
    for scene, result in results.items():
        if wanted(scene) and variant in result.counts:
            total.merge(result.counts[variant])
    return total


def table(header, rows):
    """Cells that line up; the first column to the left, the others to the right."""
    cells = [[str(cell) for cell in row] for row in [header] + rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
    lines = []
    for row in cells:
        padded = [row[0].ljust(widths[0])] + [c.rjust(w) for c, w in zip(row[1:], widths[1:])]
        lines.append("| " + " | ".join(padded) + " |")
    rule = ["-" * widths[0]] + ["-" * (w - 1) + ":" for w in widths[1:]]
    lines.insert(1, "| " + " | ".join(rule) + " |")
    return "\n".join(lines) + "\n"


def mm(value):
    return "-" if value is None else "%.0f" % value


def names_of(results, attribute):
    """Kinds or groups that were run, in their order."""
    names = []
    for scene in results:
        name = getattr(scene, attribute)
        if name not in names:
            names.append(name)
    return names


# --- the tables ----------------------------------------------------------------------------------


def kind_row(name, c):
    return [name, c.frames[True], c.detected, c.right[True], c.selected_wrong,
            c.frames[True] - c.right[True] - c.selected_wrong, c.frames[False],
            c.right[False], mm(score.percentile(c.errors_mm, 50)),
            mm(score.percentile(c.errors_mm, 90))]


def kinds(results):
    rows = [kind_row(kind, sum_counts(results, runs.FULL, lambda s, k=kind: s.kind == k))
            for kind in names_of(results, "kind")]
    rows.append(kind_row("all", sum_counts(results, runs.FULL, lambda s: True)))
    return table(["scenes", "heads", "detected", "selected right", "wrong", "none", "empty",
                  "empty right", "error 50 %, mm", "90 %"], rows)


def errors(results):
    """How far selected heads are off."""
    rows = []
    for group in names_of(results, "group") + [None]:
        of_group = sum_counts(results, runs.FULL, lambda s, g=group: g in (None, s.group))
        paper = sum_counts(results, runs.PAPER, lambda s, g=group: g in (None, s.group))
        rows.append([group or "all"] + [mm(score.percentile(c.errors_mm, p)) for c in (of_group, paper)
                                        for p in (50, 75, 90, 95)])
    return table(["position error, mm", "50 %", "75 %", "90 %", "95 %", "paper: 50 %", "75 %", "90 %",
                  "95 %"], rows)


TABLE_1 = (("six sequences", lambda s: s.group == "six"),
           ("fresh, sequence 1", lambda s: s.group == "seq 1"),
           ("fresh, sequence 2", lambda s: s.group == "seq 2"),
           ("all with one person, and empty ones", lambda s: s.group != "two"
            and s.kind != "cast on five people"))


def table_1(results, wanted):
    rows = []
    for variant in next(iter(results.values())).counts:
        c = sum_counts(results, variant, wanted)
        rows.append([variant, c.frames[True], c.detected]
                    + [c.outcomes[True][outcome] for outcome in score.OUTCOMES]
                    + [c.frames[False], c.outcomes[False]["not done"]])
    return table(["method", "heads", "detected", "correct without ambiguity", "with", "wrong", "not done",
                  "empty", "not done"], rows)


def gains(results, counted, of):
    """Frames selected right with everything, and how many more than without each part."""
    groups = names_of(results, "group")
    groups = [g for g in scenes.GROUPS if g in groups]

    def count(variant, group):
        return counted(sum_counts(results, variant, lambda s: group in (None, s.group)))

    variants = [v for v in next(iter(results.values())).counts if v != runs.FULL]
    full = {group: count(runs.FULL, group) for group in groups + [None]}
    frames = {group: sum_counts(results, runs.FULL, lambda s, g=group: g in (None, s.group))
              for group in groups + [None]}
    rows = [["full: right of all"] + ["%d/%d" % (full[g], of(frames[g])) for g in groups + [None]]]
    for variant in variants:
        rows.append([variant] + [signed(full[g] - count(variant, g)) for g in groups + [None]])
    return table(["gain of the full method over"] + groups + ["all"], rows)


def signed(number):
    return "%+d" % number if number else "0"


def several(results):
    """Heads found of heads there, accepted ones that are nobody's, frames with anybody selected."""
    names = [kind for kind in names_of(results, "kind")
             if sum_counts(results, runs.FULL, lambda s, k=kind: s.kind == k).several["frames"]]
    rows = []
    for variant in next(iter(results.values())).counts:
        sums = [sum_counts(results, variant, lambda s, k=kind: s.kind == k).several for kind in names]
        rows.append([variant] + ["%d/%d" % (c["found"], c["there"]) for c in sums]
                    + [sum(c["nobody"] for c in sums)]
                    + ["%d/%d" % (sum(c["selected"] for c in sums), sum(c["frames"] for c in sums))])
    return table(["heads found of those in the picture"] + names
                 + ["accepted, nobody there", "anybody selected, of frames"], rows)


def failure_counts(results):
    causes = {}
    for result in results.values():
        for failure in result.failures:
            what = failure.what
            off = what.split(" mm off")
            if len(off) > 1:
                what = "another position" + off[1]
            causes.setdefault(what, {}).setdefault(failure.scene.group, 0)
            causes[what][failure.scene.group] += 1
    groups = [g for g in scenes.GROUPS if g in names_of(results, "group")]
    rows = [[what] + [by.get(g, 0) for g in groups] + [sum(by.values())]
            for what, by in sorted(causes.items(), key=lambda item: -sum(item[1].values()))]
    return table(["what went wrong, full method"] + groups + ["all"], rows)


def scene_list(results):
    rows = [[scene.name, scene.kind, scene.group, scene.seed or "-", result.counts[runs.FULL].frame_count,
             result.counts[runs.FULL].right_count]
            for scene, result in results.items()]
    return table(["scene", "kind", "group", "seed", "frames", "right"], rows)


def seeds(results):
    used = sorted(scene.seed for scene in results if scene.seed)
    return ("%d scenes are rendered or cast, seeds %d to %d: reported on, nothing is tuned on them. The "
            "score's maps and curves are learnt\nfrom seeds %s and were looked at with %s (tools/learn). The data sets "
            "(six, real, range) were looked at\nwhile parameters were chosen.\n"
            % (len(used), used[0], used[-1], scenes.learnt_seeds(), scenes.CHECK_SEEDS))


def text(results, costs):
    parts = ["# Evaluation", seeds(results), "## The full method, by kind of scene", kinds(results),
             "Errors are those of heads that were selected right; truth of `range` and `cast` is an estimate "
             "within 30 mm.", errors(results),
             "## What each part brings: frames selected right",
             "Positive: the part helps. `paper` is the paper's method alone, with the missing dots filled in.",
             gains(results, lambda c: c.right_count, lambda c: c.frame_count),
             "The same, frames with a head only:",
             gains(results, lambda c: c.right[True], lambda c: c.frames[True])]
    for title, wanted in TABLE_1:
        if any(wanted(scene) for scene in results):
            parts += ["## Table 1: " + title, table_1(results, wanted)]
    if any(c.several for result in results.values() for c in result.counts.values()):
        parts += ["## Several people", several(results)]
    parts += ["## What goes wrong", failure_counts(results)]
    parts += ["## What it costs", costs] if costs else []
    parts += ["## Scenes", scene_list(results)]
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def as_json(results):
    return {
        "seeds": {"reported": sorted(scene.seed for scene in results if scene.seed),
                  "learnt": scenes.learnt_seeds(), "check": scenes.CHECK_SEEDS},
        "scenes": [{"name": scene.name, "kind": scene.kind, "group": scene.group, "seed": scene.seed,
                    "options": [os_free(option) for option in scene.options],
                    "variants": {v: c.as_json() for v, c in result.counts.items()},
                    "failures": [{"file": f.file, "what": f.what} for f in result.failures]}
                   for scene, result in results.items()],
    }


def os_free(option):
    """Where the data lie is this machine's business."""
    return option.rsplit("/range", 1)[-1].lstrip("/") or "range" if "/" in option else option
