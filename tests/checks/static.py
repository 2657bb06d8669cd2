#!/usr/bin/env python3
"""What make lint runs beside clang-tidy, over the commands of a build:

  cppcheck   over all C sources (of the tests only warnings and what is not portable), and the C++ tools
  misra      cppcheck's MISRA C:2012 addon over firmware/core
  gcc        -fanalyzer over all C sources but the tests'

What they find and is meant to be stands in the tables of docs/misra.md, with its reason: that file is
read here, nothing is listed twice. Everything else is an error, and so is a row that nothing needs.

static.py BUILD        a folder with compile_commands.json
"""

import argparse
import collections
import concurrent.futures
import fnmatch
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TABLES = "docs/misra.md"
FINDING = re.compile(r"^(?P<file>[^:\n]+):(?P<line>\d+): (?P<name>[\w.-]+): (?P<text>.*)$", re.MULTILINE)
# file:line:column: warning: text [CWE-1] [-Wanalyzer-name]; the CWE not always
ANALYZER = re.compile(r"^(?P<file>[^:\n ]+):(?P<line>\d+):\d+: \w+: (?P<text>.*?) (?:\[CWE-\d+\] )?"
                      r"\[-W(?P<name>analyzer-[\w-]+)\]$", re.MULTILINE)

Finding = collections.namedtuple("Finding", "name file line text")
# where: patterns of files; lines: what the source line must match
Row = collections.namedtuple("Row", "name where lines number")


def rows(text):
    """Those of the tables whose first column is a finding's name in backticks, or a MISRA rule."""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        cells = [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)][1:-1]
        if not cells:
            continue
        name = re.fullmatch(r"`([\w.-]+)`|(\d+\.\d+)", cells[0])
        if not name:
            continue
        if len(cells) != 5 or not all(cells):
            sys.exit("static: %s:%d: %d columns, expected finding | what | where | lines | why"
                     % (TABLES, number, len(cells)))
        lines = "" if cells[3] == "all" else cells[3].strip("`")
        found.append(Row(name[1] or "misra-c2012-" + name[2],
                         [word.strip("` ") for word in cells[2].split(",")], re.compile(lines), number))
    return found


def source_line(finding, root):
    with open(os.path.join(root, finding.file), encoding="utf-8") as file:
        return file.read().splitlines()[finding.line - 1]


def judge(findings, table, root):
    """What is in no row, and the rows that nothing is in."""
    needed, open_findings = set(), []
    for finding in sorted(set(findings)):
        line = source_line(finding, root)
        matching = [row for row in table if row.name == finding.name and row.lines.search(line) and
                    any(fnmatch.fnmatch(finding.file, where) for where in row.where)]
        needed.update(row.number for row in matching)
        if not matching:
            open_findings.append("%s:%d: %s: %s" % (finding.file, finding.line, finding.name, finding.text))
    unneeded = ["%s:%d: nothing is found any more that this row allows: take it out: %s"
                % (TABLES, row.number, row.name) for row in table if row.number not in needed]
    return open_findings, unneeded


def findings_of(pattern, output, root):
    for match in pattern.finditer(output):
        file = os.path.relpath(os.path.realpath(os.path.join(root, match["file"])), os.path.realpath(root))
        if not file.startswith(".."):
            yield Finding(match["name"], file, int(match["line"]), match["text"])


def cppcheck(options, files, root, language="c11"):
    command = ["cppcheck", "--std=" + language, "--quiet", "--force", "--library=posix", "--suppress=missingIncludeSystem",
               "--template={file}:{line}: {id}: {message}"] + options + files
    done = subprocess.run(command, cwd=root, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          check=False)
    if done.returncode:
        sys.exit("static: cppcheck ended with status %d:\n%s" % (done.returncode, done.stdout))
    broken = [line for line in done.stdout.splitlines() if "internalError" in line or "Bailing out" in line]
    if broken:
        sys.exit("static: cppcheck: " + broken[0])
    return list(findings_of(FINDING, done.stdout, root))


def misra(files, root, include):
    with tempfile.TemporaryDirectory() as directory:
        addon = os.path.join(directory, "misra.json")
        with open(addon, "w", encoding="utf-8") as file:
            json.dump({"script": "misra.py", "args": ["--no-summary"]}, file)
        every = cppcheck(["--enable=style", "--platform=unix64", "--addon=" + addon, "-I" + include,
                          "--cppcheck-build-dir=" + directory], files, root)
    return [finding for finding in every if finding.name.startswith("misra")]


def analyzed(command):
    """gcc -fanalyzer's findings in one source, from the command that builds it."""
    words = [word for word in shlex.split(command["command"])
             if not word.startswith(("-fsanitize", "-fno-sanitize", "-W", "-O", "-g"))]
    words[0] = "gcc"
    words[words.index("-o") + 1] = "/dev/null"
    done = subprocess.run(words + ["-O1", "-fanalyzer", "-fdiagnostics-path-format=none",
                                   "-fdiagnostics-color=never"],
                          cwd=command["directory"], text=True, stderr=subprocess.PIPE, check=False)
    if done.returncode:
        sys.exit("static: gcc -fanalyzer: %s:\n%s" % (command["file"], done.stderr))
    return done.stderr


def analyze(build, jobs):
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
        commands = [command for command in json.load(file)
                    if re.match("(firmware|hal|sim|tools)/", os.path.relpath(command["file"], ROOT))]
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for output in pool.map(analyzed, commands):
            yield from findings_of(ANALYZER, output, ROOT)


def tracked(root, *patterns):
    return subprocess.run(["git", "ls-files", "--"] + list(patterns), cwd=root, text=True, check=True,
                          stdout=subprocess.PIPE).stdout.split()


def includes(root, *headers):
    """Every folder with a header."""
    return ["-I" + folder for folder in sorted({os.path.dirname(path) for path in tracked(root, *headers)}
                                               | {"firmware/core", "hal"})]


def everything(build):
    """All findings, from the slowest tool on."""
    sources = tracked(ROOT, "*.c")
    tests = [path for path in sources if path.startswith("tests/unit/")]
    folders = includes(ROOT, "*.h")
    tools = ["tools/common/", "tools/calibrate/", "tools/view/"]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        results = [
            pool.submit(misra, tracked(ROOT, "firmware/core/*.c"), ROOT, "firmware/core"),
            pool.submit(lambda: list(analyze(build, 1))),
            pool.submit(cppcheck, ["--enable=warning,style,performance,portability"] + folders,
                        [path for path in sources if path not in tests], ROOT),
            pool.submit(cppcheck, ["--enable=warning,style,performance,portability"] +
                        includes(ROOT, *[folder + "*.hpp" for folder in tools]),
                        tracked(ROOT, *[folder + "*.cpp" for folder in tools]), ROOT, "c++17"),
            pool.submit(cppcheck, ["--enable=warning,portability"] + folders, tests, ROOT),
        ]
        return [finding for result in results for finding in result.result()]


def check(build):
    with open(os.path.join(ROOT, TABLES), encoding="utf-8") as file:
        table = rows(file.read())
    findings = everything(build)
    open_findings, unneeded = judge(findings, table, ROOT)
    for line in open_findings + unneeded:
        print(line)
    if open_findings or unneeded:
        print("static: %d findings, %d rows that are not needed" % (len(open_findings), len(unneeded)))
        return 1
    print("static: nothing but the %d rows of %s" % (len(table), TABLES))
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    return check(parser.parse_args().build)


if __name__ == "__main__":
    sys.exit(main())
