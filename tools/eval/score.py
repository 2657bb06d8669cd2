"""Scores of records against the truth: docs/contract.md, "Score", and nothing of host_sim's own.

A frame's truth has "head": a head, or null where nobody is; without "head" the frame is not scored.
Where truth has a list "heads", it is also looked at how many of them are found.
"""

import collections
import dataclasses
import math

MATCH_MM = 100.0
OUTCOMES = ("correct", "ambiguous", "wrong", "not done")


def distance_mm(hypothesis, centre_mm):
    return math.dist(hypothesis["centre_mm"], centre_mm)


def matches(hypothesis, centre_mm):
    return distance_mm(hypothesis, centre_mm) <= MATCH_MM


@dataclasses.dataclass(frozen=True)
class Verdict:
    """On one frame."""

    there: bool           # there is a head
    detected: bool        # a hypothesis matches it
    outcome: str          # of the selection over "heads": one of OUTCOMES
    right: bool           # selected right
    selected: bool        # a head was selected, right or wrong
    error_mm: float       # of a matching selected head, else None
    what: str             # went wrong, in words; empty when right


def selection(accepted, centre_mm):
    if not accepted:
        return "not done"
    if centre_mm is None or not any(matches(h, centre_mm) for h in accepted):
        return "wrong"
    return "correct" if len(accepted) == 1 else "ambiguous"


def what_went_wrong(record, selected, truth, detected):
    if truth["head"] is None:
        return "a head where nobody is"
    centre_mm = truth["head"]["centre_mm"]
    if selected is None:
        if len(record["heads"]) > 1:
            return "several heads, none selected"
        return "head found, not accepted" if detected else "head not among the hypotheses"
    others = [head for head in truth.get("heads", []) if head["centre_mm"] != centre_mm]
    if any(matches(selected, head["centre_mm"]) for head in others):
        return "the other person"
    off = distance_mm(selected, centre_mm)
    return "%.0f mm off%s" % (off, "" if detected else ", head not among the hypotheses")


def judge(record, truth):
    """The verdict on a frame; None where truth says nothing."""
    if "head" not in truth:
        return None
    centre_mm = None if truth["head"] is None else truth["head"]["centre_mm"]
    hypotheses = record["hypotheses"]
    selected = None if record["head"] is None else hypotheses[record["head"]]
    detected = centre_mm is not None and any(matches(h, centre_mm) for h in hypotheses)
    if centre_mm is None or selected is None:
        right = centre_mm is None and selected is None
    else:
        right = matches(selected, centre_mm)
    error_mm = distance_mm(selected, centre_mm) if right and selected else None
    what = "" if right else what_went_wrong(record, selected, truth, detected)
    outcome = selection([hypotheses[i] for i in record["heads"]], centre_mm)
    return Verdict(centre_mm is not None, detected, outcome, right, selected is not None, error_mm,
                   what)


def people(record, centres_mm):
    """(heads found, accepted ones that are nobody's, the selected one is somebody's) where the heads
    of several people are known. Each accepted one finds at most one head, nearest pairs first."""
    accepted = [record["hypotheses"][i] for i in record["heads"]]
    pairs = sorted((distance_mm(h, centre), i, j) for i, h in enumerate(accepted)
                   for j, centre in enumerate(centres_mm))
    used, found = set(), set()
    for off, i, j in pairs:
        if off <= MATCH_MM and i not in used and j not in found:
            used.add(i)
            found.add(j)
    nobody = sum(not any(matches(h, centre) for centre in centres_mm) for h in accepted)
    selected = record["head"] is not None and any(
        matches(record["hypotheses"][record["head"]], centre) for centre in centres_mm)
    return len(found), nobody, selected


def percentile(values, percent):
    """The value that this fraction of them does not exceed; None of nothing."""
    if not values:
        return None
    return sorted(values)[max(1, math.ceil(len(values) * percent / 100)) - 1]


class Counts:
    """Verdicts summed up."""

    def __init__(self):
        self.frames = {True: 0, False: 0}  # by whether a head is there
        self.detected = 0
        self.outcomes = {True: collections.Counter(), False: collections.Counter()}
        self.right = {True: 0, False: 0}
        self.selected_wrong = 0  # a head is there, another position was selected
        self.errors_mm = []
        self.several = collections.Counter()  # frames, there, found, nobody, selected

    def add(self, verdict):
        self.frames[verdict.there] += 1
        self.detected += verdict.detected
        self.outcomes[verdict.there][verdict.outcome] += 1
        self.right[verdict.there] += verdict.right
        self.selected_wrong += verdict.there and not verdict.right and verdict.selected
        if verdict.error_mm is not None:
            self.errors_mm.append(verdict.error_mm)

    def add_people(self, there, found, nobody, selected):
        self.several.update(frames=1, there=there, found=found, nobody=nobody, selected=selected)

    def merge(self, other):
        for there in (True, False):
            self.frames[there] += other.frames[there]
            self.outcomes[there].update(other.outcomes[there])
            self.right[there] += other.right[there]
        self.detected += other.detected
        self.selected_wrong += other.selected_wrong
        self.errors_mm += other.errors_mm
        self.several.update(other.several)

    @property
    def frame_count(self):
        return self.frames[True] + self.frames[False]

    @property
    def right_count(self):
        return self.right[True] + self.right[False]

    def as_json(self):
        with_head = self.outcomes[True]
        return {
            "heads": self.frames[True], "detected": self.detected,
            **{outcome.replace(" ", "_"): with_head[outcome] for outcome in OUTCOMES},
            "selected_right": self.right[True], "selected_wrong": self.selected_wrong,
            "empty": self.frames[False], "empty_right": self.right[False],
            "error_50_mm": rounded(percentile(self.errors_mm, 50)),
            "error_90_mm": rounded(percentile(self.errors_mm, 90)),
            **({"people": dict(sorted(self.several.items()))} if self.several else {}),
        }


def rounded(value):
    return None if value is None else round(value, 1)
