#!/usr/bin/env python3
"""The field's words: no old word of this project's own where a textbook has one.

NAMES are parts of identifiers (rest_q4 has the parts rest and q4), in code and wherever an identifier with
an underscore is written. PROSE are phrases in comments, messages and documents, also across the end of a
line. A string without a blank is a key, an option or a file name, which others read: it is not checked.
The name of a test is a sentence: it is read as prose.

words.py [FOLDER...]      exit status 1 where an old word stands, each with file, line and the word to use
words.py --counts         how many, by folder
"""

import collections
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

# Parts of identifiers.
NAMES = {
    "asked": "requested, needed",
    "cuts": "contours",
    "doubt": "sigma, uncertainty",
    "findings": "detections",
    "glance": "promise",
    "grains": "speckle",
    "greatest": "max",
    "least": "min",
    "less": "sub, difference",
    "lonely": "isolated",
    "mended": "fixed",
    "most": "max",
    "rating": "score",
    "ratings": "scores",
    "rest": "residual, remainder",
    "share": "fraction",
    "shares": "fractions",
    "tally": "counts",
    "tell": "report",
    "told": "reported",
    "turn": "rotation",
    "turned": "rotated",
    "twins": "laser-on/laser-off pairs",
    "way": "method, mode, distance: say which",
}

# Phrases; a blank stands for any white space, also for a new line of a comment.
PROSE = {
    r"asked for ahead": "prefetched",
    r"at a glance": "coarse pre-filter, early rejection",
    r"at the least": "at least",
    r"at the most": "at most",
    r"cannot be told|can be told": "can (not) be determined",
    r"carried heads?": "predicted (coasting) track",
    r"cut off in depth": "clipped",
    r"(?:the|all|of|open|closed|no|its|their|these) cuts": "contours, level sets",
    r"(?:half )?the doubt": "(half) the standard deviation",
    r"findings|(?:a|the|each|every|one) finding": "detections",
    r"foresees?|foreseen": "predicted; branch prediction",
    r"gave nothing|gives nothing": "no gain",
    r"grains": "speckle",
    r"greatest": "largest, max",
    r"(?:is|are|was|were|be|been|being|not|and|or) told": "reported; to tell apart: distinguished",
    r"leans? on": "is regularised towards",
    r"lonely": "isolated",
    r"long peace": "long stable period",
    r"mend(?:s|ed)?": "fixed, corrected",
    r"ratings?": "score",
    r"share of": "fraction of",
    r"tall(?:y|ies)": "counts",
    r"the least(?! (?:squares|significant))": "the smallest, the minimum",
    r"twins": "laser-on/laser-off pairs",
    r"usual sort": "default kind",
    r"\* Way:": "Method:, Rounding: or Output:",
}

# What is not read: data, what was written once and is not edited, and this table.
SKIPPED = (
    "CHANGELOG.md",
    "docs/experiments/",
    "tests/checks/words.py",
    "tests/fuzz/corpus/",
    "tests/vectors/",
)

# Where an old word is the right one: a pattern of the path, of what stands there, and why.
EXCEPTIONS = [
    (r".", r"(?i)at_(most|least)", "plain English"),
    (r".", r"TEST_ASSERT_\w+|assertLess\w*|is_less", "names of Unity and unittest; a comparison"),
    (r".", r"visible_share", "a key of truth.jsonl (docs/contract.md)"),
    (r"^tests/checks/(static|lint_commands)\.py$|^docs/misra\.md$", r"(?i).*findings?.*", "what a linter reports"),
    (r"^docs/contract\.md$", r"findings", "a key of a record and of a trace"),
    (r"^docs/trust\.md$", r"findings", "a target of the fuzzers, and their folder"),
    (r"^sim/report/.*\.js$", r"cuts|(mature_)?findings", "keys of a trace (docs/contract.md)"),
    (r"^tests/limits\.conf$", r"bench_findings_instructions", "a key of build/bench.json"),
    (r"^tools/bench/", r"(take_)?turns?", "programs that are timed take turns"),
    (r"^tools/render/", r"(?i).*turn(ed)?.*", "a person turns"),
]

IDENTIFIER = r"[A-Za-z_]\w*"
# What a file consists of: comments, strings, identifiers; the first group is prose, the second a string.
C_LIKE = re.compile(r"(/\*.*?\*/|//[^\n]*)|(\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'|`[^`]*`)|" + IDENTIFIER, re.S)
PYTHON = re.compile(r"(#[^\n]*|\"\"\".*?\"\"\")|(\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*')|" + IDENTIFIER, re.S)
BLANK = r"(?:\s|\n[ \t]*(?:\*|//|#|\.\\\")|\"\n\s*[a-z]{0,2}\")+"
PHRASES = [(re.compile(r"(?<!\w)(?:%s)(?!\w)" % phrase.replace(" ", BLANK), re.I), use) for phrase, use in PROSE.items()]
WORD = re.compile(IDENTIFIER)
# A name of so many parts is a sentence.
SENTENCE_PARTS = 5

Old = collections.namedtuple("Old", "file line found use")


def parts(name):
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower().split("_")


def old_name(name):
    """The field's word for the first part that is an old one; None when none is."""
    pieces = parts(name)
    if len(pieces) >= SENTENCE_PARTS and name == name.lower():
        return old_phrases(" ".join(pieces))
    return [(0, name, NAMES[piece]) for piece in pieces if piece in NAMES][:1]


def old_phrases(text):
    """Where phrases stand in a text: (offset, phrase, what to use)."""
    return [(hit.start(), hit[0], use) for phrase, use in PHRASES for hit in phrase.finditer(text)]


def old_prose(text):
    found = old_phrases(text)
    for hit in WORD.finditer(text):
        if "_" in hit[0]:
            found += [(hit.start(), name, use) for _, name, use in old_name(hit[0])]
    return found


def old_words(path, text):
    """All old words of a text, by what kind of file it is: (offset, what, what to use)."""
    pattern = C_LIKE if re.search(r"\.(c|h|cpp|hpp|js)$", path) else PYTHON if path.endswith(".py") else None
    if pattern is None:
        return old_prose(text)
    found = []
    for token in pattern.finditer(text):
        if token[1] or token[2]:
            if token[1] or " " in token[2]:
                found += [(token.start() + at, what, use) for at, what, use in old_prose(token[0])]
        else:
            found += [(token.start(), what, use) for _, what, use in old_name(token[0])]
    return found


def is_excepted(path, what):
    return any(re.search(where, path) and re.fullmatch(pattern, what) for where, pattern, _ in EXCEPTIONS)


def old_of(path):
    try:
        with open(os.path.join(ROOT, path), encoding="utf-8") as file:
            text = file.read()
    except (UnicodeDecodeError, FileNotFoundError):
        return []
    return [Old(path, text.count("\n", 0, at) + 1, " ".join(re.sub(r"\s[*#/]+\s", " ", what).split()), use)
            for at, what, use in sorted(old_words(path, text)) if not is_excepted(path, what)]


def tracked():
    names = subprocess.run(["git", "-C", ROOT, "ls-files"], check=True, text=True, stdout=subprocess.PIPE).stdout
    return [path for path in names.splitlines() if not path.startswith(SKIPPED)]


def folder_of(path):
    pieces = path.split("/")[:-1]
    return "/".join(pieces[:3 if path.startswith("firmware/core") or path.startswith("tests/unit") else 2]) or "."


def main(arguments):
    only = tuple(argument for argument in arguments if argument != "--counts")
    found = [old for path in tracked() if path.startswith(only or "") for old in old_of(path)]
    if "--counts" in arguments:
        for folder, count in sorted(collections.Counter(folder_of(old.file) for old in found).items()):
            print("%-28s %5d" % (folder, count))
    else:
        for old in found:
            print("%s:%d: %s -> %s" % (old.file, old.line, old.found, old.use))
    print("words: %d old ones" % len(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
