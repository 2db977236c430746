#!/usr/bin/env python3
"""test_results.py ROOT: checks benchmarks/results and the relative links of all Markdown files.

Every stored file is in the table of results/README.md or linked from a document. No run is "-dirty". The files have at
most 3 MB. Every relative link leads to a file or a folder, and its anchor to a heading."""

import fnmatch
import os
import re
import subprocess
import sys
import urllib.parse

MOST_BYTES = 3_000_000
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
DEFINITION = re.compile(r"^\[([^\]]+)\]: (\S+)$", flags=re.MULTILINE)
# | [run] | machine | files | ...
ROW = re.compile(r"^\| \[([^\]]+)\] \|[^|]*\|([^|]*)\|", flags=re.MULTILINE)


def tracked(root, *patterns):
    names = subprocess.run(["git", "-C", root, "ls-files", "-z", *patterns], check=True, capture_output=True, text=True)
    return [name for name in names.stdout.split("\0") if name and os.path.exists(os.path.join(root, name))]


def read(root, name):
    with open(os.path.join(root, name), encoding="utf-8") as file:
        return file.read()


def without_code(text):
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    return re.sub(r"`[^`\n]*`", "", text)


def anchors(text):
    """Anchors of the headings, as GitHub makes them."""
    found = set()
    for title in re.findall(r"^#+ +(.*?) *$", text, flags=re.MULTILINE):
        title = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title)
        found.add(re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-"))
    return found


def links(root, page):
    """(target as written, path from the root, anchor) of each relative link."""
    text = without_code(read(root, page))
    for target in LINK.findall(text) + [target for _, target in DEFINITION.findall(text)]:
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = urllib.parse.unquote(target).partition("#")
        path = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
        yield target, path, anchor


def dead_links(root, pages):
    faults = []
    for page in pages:
        for target, path, anchor in links(root, page):
            if not os.path.exists(os.path.join(root, path)):
                faults.append(f"{page}: dead link: {target}")
            elif anchor and path.endswith(".md") and anchor not in anchors(read(root, path)):
                faults.append(f"{page}: link to a missing heading: {target}")
    return faults


def listed(root, folder):
    """The patterns of paths in the table of the folder's README.md."""
    text = read(root, f"{folder}/README.md")
    runs = dict(DEFINITION.findall(text))
    return [f"{folder}/{runs.get(run, run)}/{name}" for run, files in ROW.findall(text)
            for name in re.findall(r"`([^`]+)`", files)]


def stored_files(root, folder, pages):
    faults = []
    linked = {path for page in pages for _, path, _ in links(root, page)}
    patterns = listed(root, folder)
    size = 0
    files = tracked(root, folder)
    for name in files:
        size += os.path.getsize(os.path.join(root, name))
        if "-dirty" in name:
            faults.append(f"{name}: a run with uncommitted changes")
        if name != f"{folder}/README.md" and name not in linked and not any(
                fnmatch.fnmatchcase(name, pattern) for pattern in patterns):
            faults.append(f"{name}: neither in the table of {folder}/README.md nor linked from a document")
    for pattern in patterns:
        if not any(fnmatch.fnmatchcase(name, pattern) for name in files):
            faults.append(f"{folder}/README.md: no file {pattern}")
    if size > MOST_BYTES:
        faults.append(f"{folder}: {size} bytes, at most {MOST_BYTES} expected: remove older runs (git keeps them)")
    return faults


def main():
    root = sys.argv[1]
    if subprocess.run(["git", "-C", root, "rev-parse"], capture_output=True, check=False).returncode != 0:
        print("skipped: not a git checkout")
        return 77
    pages = tracked(root, "*.md")
    faults = dead_links(root, pages) + stored_files(root, "benchmarks/results", pages)
    for fault in faults:
        print(f"test_results: {fault}", file=sys.stderr)
    print(f"{len(pages)} pages checked")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
