#!/usr/bin/env python3
"""Links and names in the pages: every Markdown file that is tracked.

  links     a relative link leads to a file that is tracked, or to a folder of such; #SECTION to a heading of it
  files     a path in `backticks` that begins with a folder of the tree, or a page's name.md, is there
  names     an ih_NAME in `backticks` is in the sources of the firmware, or in the headers of its tests
  targets   `make TARGET` is a target of the Makefile
  tests     a `name` in the column "shown by" of docs/safety.md is a test, a case of the emulated board, or a test's file

Experiments and the change log name things as they were: only their links are checked.

links.py      exit status 1 where something is not there, each with file and line
"""

import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"`([^`\n]+)`")
PATH = re.compile(r"[\w.-]+(?:/[\w.-]+)+/?$")
IH_NAME = re.compile(r"\bih_[a-z0-9_]+\b|\bIH_[A-Z0-9_]+\b")
TARGET = re.compile(r"\bmake ([a-z][a-z0-9-]*)")
FENCE = re.compile(r"^( *)```.*?^\1```", re.S | re.M)
TEST = re.compile(r"^(?:static )?(?:void|def) (?:case_)?(\w+)\(", re.M)
HISTORY = ("docs/experiments/", "CHANGELOG.md")
# What CONTRIBUTING.md makes up for its example.
EXAMPLE = re.compile(r"counter|ih_(noun_verb|noun|upper)\b")


def tracked():
    out = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, text=True, stdout=subprocess.PIPE).stdout
    return [path for path in out.splitlines() if os.path.exists(os.path.join(ROOT, path))]


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def anchors(text):
    """Names of sections as GitHub makes them."""
    heads = re.findall(r"^#+ (.*)", text, re.M)
    return {re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in heads}


def blank(code):
    """As long as it was, so that offsets stay."""
    return re.sub(r"[^\n]", " ", code[0])


def there(path, files, folders):
    path = os.path.normpath(path)
    return path in files or path in folders


def check_links(page, text, files, folders):
    for hit in LINK.finditer(CODE.sub(blank, FENCE.sub(blank, text))):
        target, _, section = hit[1].partition("#")
        if re.match(r"\w+:", hit[1]):
            continue
        path = os.path.normpath(os.path.join(os.path.dirname(page), target)) if target else page
        if not there(path, files, folders):
            yield hit.start(), "no file %s" % path
        elif section and section not in anchors(read(path)):
            yield hit.start(), "no section %s in %s" % (section, path)


def check_names(page, text, files, folders, known):
    tops = {path.split("/")[0] for path in files if "/" in path} - {"build"}
    pages = {os.path.basename(path) for path in files if path.endswith(".md")}
    for hit in CODE.finditer(text):
        for word in hit[1].split():
            if PATH.match(word) and word.split("/")[0] in tops and not EXAMPLE.search(word):
                if not there(word, files, folders) and not re.search(r"FOLDER|NAME|NNN", word):
                    yield hit.start(), "no file %s" % word
            elif re.match(r"[\w-]+\.md$", word) and word not in pages and not re.search(r"NNN|NAME|name", word):
                yield hit.start(), "no page %s" % word
        for name in IH_NAME.findall(hit[1]):
            if name not in known and not name.endswith("_") and not EXAMPLE.search(name.lower()):
                yield hit.start(), "no source has the name %s" % name
    targets = set(re.findall(r"^([a-z][a-z0-9-]*):", read("Makefile"), re.M))
    for hit in TARGET.finditer("\n".join("%s" % code for code in CODE.findall(text))):
        if hit[1] not in targets:
            yield text.find("make " + hit[1]), "no target %s" % hit[1]


def check_tests(text, files):
    """Of the tables that end with the column, and have a heading of bold letters in between."""
    tests = {os.path.basename(path).split(".")[0] for path in files if path.startswith("tests/")}
    for path in files:
        if path.startswith("tests/") and path.endswith((".c", ".py")):
            tests.update(TEST.findall(read(path)))
    in_table = False
    for hit in re.finditer(r".*\n", text):
        line = hit[0].rstrip()
        in_table = line.startswith("|") and (in_table or line.endswith("| shown by |"))
        for name in CODE.findall(line.strip("|").rpartition("|")[2] if in_table else ""):
            if not name.startswith("make ") and name not in tests:
                yield hit.start(), "no test %s" % name


def main():
    listed = tracked()
    files = set(listed)
    folders = {os.path.dirname(path)[:end] for path in files for end in
               [i for i, c in enumerate(os.path.dirname(path) + "/") if c == "/"]}
    known = set()
    for path in listed:
        if path.startswith(("firmware/", "tests/unit/ih_")) and path.endswith((".c", ".h")):
            known.add(os.path.splitext(os.path.basename(path))[0])
            known.update(re.findall(r"\b(?:ih|IH)_\w+", read(path)))
    wrong = 0
    for page in listed:
        if not page.endswith(".md"):
            continue
        text = read(page)
        found = list(check_links(page, text, files, folders))
        if not page.startswith(HISTORY):
            found += check_names(page, text, files, folders, known)
        if page == "docs/safety.md":
            found += check_tests(text, files)
        for offset, what in found:
            print("%s:%d: %s" % (page, text.count("\n", 0, offset) + 1, what))
        wrong += len(found)
    print("links: %d not there" % wrong)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
