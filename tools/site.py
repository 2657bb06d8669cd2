#!/usr/bin/env python3
"""The pages of this repository as a static site, with a report page of the rendered frames in it.

    site.py OUT REPORT.html     OUT: a folder that is new, or was written by this program

Every tracked *.md becomes OUT/PATH.html, README.md is OUT/index.html; pictures are copied. A link to a source file, for which
there is no page, becomes the file's name. Nothing is loaded from elsewhere. Exit status 1 where a link leads nowhere.
"""

import html
import os
import posixpath
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser

from markdown_it import MarkdownIt

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
MARK = ".isohead-site"  # in a folder that may be replaced
# What stands at the left, in this order; experiments are below their own page.
MENU = (
    ("", (("README.md", "Overview"), ("report.html", "A run, frame by frame"))),
    ("Use", (("docs/report.md", "Report page"), ("docs/depth_camera.md", "Your depth camera, films"), ("python/README.md", "From Python"),
             ("docs/calibration.md", "Calibration"),
             ("docs/contract.md", "Files and output"), ("docs/view.md", "Pictures and films"), ("docs/export.md", "Foxglove, CSV"), ("docs/ros2.md", "UDP, ROS 2"))),
    ("On a board", (("docs/hardware.md", "Hardware"), ("docs/live.md", "Live view"), ("docs/health.md", "Does the rig fit?"), ("docs/safety.md", "The laser"))),
    ("Inside", (("docs/design.md", "Design"), ("docs/experiments/README.md", "Experiments"), ("docs/performance.md", "Performance"),
                ("docs/porting.md", "Porting"), ("docs/numerics.md", "Number formats"), ("docs/simd.md", "Vectors"), ("docs/trust.md", "What is promised"),
                ("docs/misra.md", "MISRA C"), ("docs/people.md", "Rendered people"))),
    ("Project", (("CONTRIBUTING.md", "Contributing"), ("CHANGELOG.md", "Changes"), ("SECURITY.md", "Security"))),
)
STYLE = """
:root { --ground: #f6f5f2; --panel: #fff; --ink: #1d1d1b; --quiet: #5b5953; --line: #dad6cd; --accent: #0a5ea8; color-scheme: light; }
@media (prefers-color-scheme: dark) {
  :root { --ground: #121417; --panel: #1a1d22; --ink: #e9e7e2; --quiet: #a9a69e; --line: #353a43; --accent: #70b8f5; color-scheme: dark; }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--ink); font: 1rem/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif;
  overflow-wrap: break-word; }
.page { display: grid; grid-template-columns: 15rem minmax(0, 54rem); gap: 2.5rem; max-width: 76rem; margin: 0 auto; padding: 0 1.2rem 4rem; }
nav { position: sticky; top: 0; align-self: start; max-height: 100vh; overflow-y: auto; padding: 1.2rem 0; font-size: .93rem; }
nav summary { display: none; }
nav p { margin: 1rem 0 .2rem; color: var(--quiet); font-size: .82rem; }
nav ul { list-style: none; margin: 0; padding: 0; }
nav a { display: block; padding: .16rem .6rem; color: var(--ink); text-decoration: none; border-left: 3px solid transparent; }
nav a:hover { border-color: var(--line); }
nav a[aria-current] { border-color: var(--accent); color: var(--accent); font-weight: 600; }
main { padding-top: 1rem; min-width: 0; }
a { color: var(--accent); }
:focus-visible { outline: 3px solid var(--accent); outline-offset: 2px; border-radius: 4px; }
h1 { font-size: 1.9rem; line-height: 1.2; letter-spacing: -.01em; margin: .6rem 0 1rem; }
h2 { font-size: 1.35rem; margin: 2.2rem 0 .6rem; padding-top: .6rem; border-top: 1px solid var(--line); }
h3 { font-size: 1.1rem; margin: 1.6rem 0 .4rem; }
img { max-width: 100%; height: auto; border-radius: 6px; }
code { font: .9em/1.4 ui-monospace, SFMono-Regular, Menlo, Consolas, "DejaVu Sans Mono", monospace; background: var(--panel); border: 1px solid var(--line);
  border-radius: 4px; padding: .05em .3em; }
pre { background: var(--panel); border: 1px solid var(--line); border-radius: 8px; padding: .8rem 1rem; overflow-x: auto; }
pre code { background: none; border: 0; padding: 0; white-space: pre; }
.table { overflow-x: auto; margin: 1rem 0; background: var(--panel); border: 1px solid var(--line); border-radius: 8px; }
table { border-collapse: collapse; width: 100%; font-size: .93rem; font-variant-numeric: tabular-nums; }
th, td { padding: .4rem .8rem; text-align: left; vertical-align: top; min-width: 5rem; }
td:first-child { overflow-wrap: normal; }
thead th { color: var(--quiet); border-bottom: 1px solid var(--line); }
thead th:empty { padding: 0; }
tbody tr + tr td { border-top: 1px solid var(--line); }
.open { display: inline-block; background: var(--accent); color: var(--ground); padding: .5rem 1rem; border-radius: 8px; font-weight: 600; text-decoration: none; }
footer { color: var(--quiet); font-size: .88rem; margin-top: 3rem; border-top: 1px solid var(--line); }
@media (max-width: 56rem) {
  .page { display: block; padding: 0 1rem 3rem; }
  nav { position: static; max-height: none; padding: .6rem 0; border-bottom: 1px solid var(--line); }
  nav summary { display: block; cursor: pointer; font-weight: 600; padding: .3rem 0; }
  h1 { font-size: 1.5rem; }
}
"""
# The menu is open beside the page and closed above it.
SCRIPT = "document.querySelector('nav details').open = matchMedia('(min-width: 56rem)').matches;"
TEMPLATE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src 'self' data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<link rel="icon" href="data:,">
<title>%(title)s</title>
<style>%(style)s</style>
</head>
<body>
<div class="page">
<nav aria-label="Pages"><details open><summary>isohead: all pages</summary>
%(menu)s</details></nav>
<script>%(script)s</script>
<main>
%(body)s
<footer><p>Made from %(source)s by make site.</p></footer>
</main>
</div>
</body>
</html>
"""


def tracked():
    out = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
    return {path for path in out.decode().split("\0") if path and os.path.exists(os.path.join(ROOT, path))}


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def output_of(page):
    return "index.html" if page == "README.md" else page[:-len(".md")] + ".html"


def slug(heading):
    """Names of sections as GitHub makes them, from the heading's HTML."""
    text = html.unescape(re.sub(r"<[^>]*>", "", heading))
    return re.sub(r"[^\w -]", "", text.lower()).strip().replace(" ", "-")


def to_html(text):
    body = MarkdownIt("commonmark").enable("table").render(text)
    body = re.sub(r"<(h\d)>(.*?)</\1>", lambda hit: '<%s id="%s">%s</%s>' % (hit[1], slug(hit[2]), hit[2], hit[1]), body)
    return body.replace("<table>", '<div class="table" tabindex="0" role="region" aria-label="Table"><table>').replace("</table>", "</table></div>")


def relink(body, page, files, copied):
    """Links to pages lead to what was made of them; pictures are noted, to be copied; of sources only the name stays."""
    here = posixpath.dirname(output_of(page))

    def one(hit):
        start, target, end = hit[1], html.unescape(hit[2]), hit[3]
        path, _, section = target.partition("#")
        if re.match(r"\w+:", target) or not path:
            return hit[0]
        path = posixpath.normpath(posixpath.join(posixpath.dirname(page), path))
        if path + "/README.md" in files:
            path += "/README.md"
        if path in files and path.endswith(".md"):
            path = output_of(path)
        elif path in files and path.endswith((".png", ".svg", ".pdf")):
            copied.add(path)
        elif start.startswith("<a"):
            return "<a" + end  # no page: an anchor without a target is plain text
        target = posixpath.relpath(path, here or ".") + ("#" + section if section else "")
        return start + html.escape(target) + end
    return re.sub(r'(<(?:a|img)\b[^>]*?(?:href|src)=")([^"]*)("[^>]*>)', one, body)


def menu_of(page):
    here = posixpath.dirname(output_of(page))
    out = []
    for heading, entries in MENU:
        out.append((("<p>%s</p>" % heading) if heading else "") + "<ul>")
        for source, name in entries:
            target = output_of(source) if source.endswith(".md") else source
            current = ' aria-current="page"' if source == page else ""
            out.append('<li><a href="%s"%s>%s</a></li>' % (posixpath.relpath(target, here or "."), current, name))
        out.append("</ul>")
    return "\n".join(out)


def write_page(out, page, files, copied):
    text = read(page)
    body = relink(to_html(text), page, files, copied)
    if page == "README.md":
        body = body.replace("</p>", '</p>\n<p><a class="open" href="report.html#sequence2/000020">See a run, frame by frame</a></p>', 1)
    title = re.search(r"^# (.*)", text, re.M)
    path = os.path.join(out, output_of(page))
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write(TEMPLATE % {"title": html.escape("isohead" if page == "README.md" else title[1] + " - isohead"), "style": STYLE, "script": SCRIPT,
                               "menu": menu_of(page), "body": body, "source": page})


class Links(HTMLParser):
    """What a page refers to, and the names that it has."""

    def __init__(self):
        super().__init__()
        self.targets, self.loaded, self.names = [], [], set()

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.names.update(values[key] for key in ("id", "name") if values.get(key))
        if tag == "a" and values.get("href"):
            self.targets.append(values["href"])
        elif tag in ("img", "script", "link", "source", "video", "iframe"):
            self.loaded += [values[key] for key in ("src", "href") if values.get(key)]


def check(out):
    """Lines that say what leads nowhere, or is loaded from elsewhere."""
    pages = {}
    for folder, _, names in os.walk(out):
        for name in names:
            if name.endswith(".html") and name != "report.html":
                path = os.path.relpath(os.path.join(folder, name), out)
                pages[path] = Links()
                with open(os.path.join(out, path), encoding="utf-8") as file:
                    pages[path].feed(file.read())
    for page, links in sorted(pages.items()):
        for target in links.targets + links.loaded:
            if target in links.loaded and re.match(r"(?!data:)\w+:|//", target):
                yield "%s: loads %s from elsewhere" % (page, target)
            if re.match(r"\w+:", target):
                continue
            path, _, section = target.partition("#")
            path = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
            if not os.path.exists(os.path.join(out, path)):
                yield "%s: %s: there is no %s" % (page, target, path)
            elif section and path in pages and section not in pages[path].names:
                yield "%s: %s: %s has no section %s" % (page, target, path, section)
    reached, waiting = set(), ["index.html"]
    while waiting:
        page = waiting.pop()
        if page not in reached and page in pages:
            reached.add(page)
            waiting += [os.path.normpath(os.path.join(os.path.dirname(page), target.split("#")[0])) for target in pages[page].targets if target.split("#")[0]]
    for page in sorted(set(pages) - reached):
        yield "%s: no link leads there from index.html" % page


def main():
    if len(sys.argv) != 3:
        print(__doc__.strip().split("\n\n")[1], file=sys.stderr)
        return 2
    out, report = sys.argv[1:]
    if os.path.exists(out) and not os.path.exists(os.path.join(out, MARK)):
        print("site: %s: is there and not from this program; name another folder" % out, file=sys.stderr)
        return 2
    shutil.rmtree(out, ignore_errors=True)
    os.makedirs(out)
    with open(os.path.join(out, MARK), "w", encoding="utf-8"):
        pass
    files, copied = tracked(), set()
    pages = sorted(path for path in files if path.endswith(".md"))
    for page in pages:
        write_page(out, page, files, copied)
    for path in copied:
        os.makedirs(os.path.dirname(os.path.join(out, path)), exist_ok=True)
        shutil.copy(os.path.join(ROOT, path), os.path.join(out, path))
    shutil.copy(report, os.path.join(out, "report.html"))
    wrong = list(check(out))
    for line in wrong:
        print("site: " + line, file=sys.stderr)
    size = sum(os.path.getsize(os.path.join(folder, name)) for folder, _, names in os.walk(out) for name in names)
    print("site: %d pages, %d pictures, %.1f MB: %s" % (len(pages), len(copied), size / 1e6, os.path.join(out, "index.html")))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
