#!/usr/bin/env python3
"""test_words.py ROOT [--update | --list [PREFIX]]: what a script can check of how we write.

Counted, per folder:
- lines over 120 characters;
- sentences over 25 words, in Markdown prose and in comments that begin with ///;
- phrases of a diary ("since 8b458ff", "was 0.62", "no longer") and compressed phrases ("but for", "of which");
- tables of more than 6 columns, and pages over 250 lines (README.md: 150, decision records: 60).

words_allowed.json, beside this file, holds how many of each kind a folder may have; there is no entry for 0. A higher
count is a fault. --update stores counts that have fallen; it never raises one. --list prints each fault.
"""

import collections
import json
import re
import sys
from pathlib import Path

import pages

LINE, SENTENCE, COLUMNS = 120, 25, 6
SOURCES = (".h", ".cpp", ".hip", ".py", ".sh", ".cmake", ".txt")
DIARY = re.compile(
    r"\bsince (?:commit )?[0-9a-f]{7,}\b|\bwas \d|\bno longer\b|\b(?<!is )(?<!are )(?<!be )used to\b|"
    r"\b(?:is|are) now\b|\bnow (?:is|are)\b|\buntil now\b|\bha(?:s|ve) become\b|\bpreviously\b|\bformerly\b|"
    r"\bany ?more\b|\bsince then\b|\bin earlier versions\b|\bnot taken\b", re.IGNORECASE)
COMPRESSED = re.compile(r"\bof which\b|\bbut for\b|\bin the place of\b|\bthose that\b", re.IGNORECASE)
DATED = ("CHANGELOG.md", pages.RESULTS)  # Pages that tell history.
WORD = re.compile(r"[A-Za-zÀ-ÿ][A-Za-zÀ-ÿ'’-]+")
BEGINS_SENTENCE = re.compile(r"[.!?][)\"'*]*(?:\s+|$)|\s@(?:param|return|tparam|pre)\b")

Fault = collections.namedtuple("Fault", "kind name line text")


def folder_of(name: str) -> str:
    if name.startswith(pages.DOCS + "proofs/"):
        return pages.DOCS + "proofs"
    if name.startswith(pages.DOCS):
        return pages.DOCS.rstrip("/")
    return name.split("/")[0]


def plain(text: str) -> str:
    """Prose in which a code span is one word, and a quoted test or a link's address none."""
    text = pages.LINK.sub(r"\1", pages.COMMENT.sub("", text))
    return pages.SPAN.sub(lambda m: "" if re.search(r'"|\.(?:cpp|hip|h|md|py)$', m[1]) else "code", text)


def long_sentences(text: str) -> list[str]:
    # A dot within a number, a file name or a short form ends nothing.
    text = re.sub(r"\b(?:e\.g|i\.e|cf|et al|vs|sect|ch|ed|approx)\.", "", text)
    return [s.strip() for s in BEGINS_SENTENCE.split(text) if len(WORD.findall(s)) > SENTENCE]


def paragraphs(lines: list[tuple[int, str]]):
    """(line, text) of each paragraph or item of a list."""
    first, collected = 0, []
    for number, line in lines + [(0, "")]:
        item = re.match(r"\s*(?:[-*]|\d+\.)\s+", line)
        if collected and (item or not line.strip()):
            yield first, " ".join(collected)
            collected = []
        if line.strip():
            first = first if collected else number
            collected.append(line[item.end():] if item else line.strip())


def phrase_faults(name: str, line: int, text: str) -> list[Fault]:
    faults = [] if name.startswith(DATED) else [Fault("diary", name, line, m[0]) for m in DIARY.finditer(text)]
    return faults + [Fault("compressed", name, line, m[0]) for m in COMPRESSED.finditer(text)]


def page_faults(name: str, text: str) -> list[Fault]:
    faults = []
    lines = text.splitlines()
    limit = 150 if name == "README.md" else 60 if "/decisions/" in name else 250
    if len(lines) > limit:
        faults.append(Fault("pages", name, len(lines), f"{len(lines)} lines, the limit is {limit}"))
    prose = []
    for number, line in enumerate(pages.without_code(text).splitlines(), 1):
        table, other = line.startswith("|"), line.startswith(("#", "    ", "!["))
        if table and not re.fullmatch(r"[|:\- ]+", line) and len(re.findall(r"(?<!\\)\|", line)) - 1 > COLUMNS:
            faults.append(Fault("columns", name, number, line[:60]))
        prose.append((number, "" if table or other else line))
        if table:
            faults += phrase_faults(name, number, plain(line))
    for number, paragraph in paragraphs(prose):
        faults += phrase_faults(name, number, plain(paragraph))
        faults += [Fault("sentences", name, number, s) for s in long_sentences(plain(paragraph))]
    return faults


def comments(name: str, text: str):
    """(line, text, whether it is documentation) of each comment."""
    script = not name.endswith((".h", ".cpp", ".hip"))
    mark = re.compile(r"(?:^|\s)#(?!!)\s?(.*)$" if script else r"(?:^|\s)//(/?)<?\s?(.*)$")
    block, documentation = [], False
    for number, line in enumerate(text.splitlines() + [""], 1):
        match = mark.search(line)
        alone = bool(match) and not line[:match.start()].strip()
        is_doc = bool(match) and not script and match[1] == "/"
        said = match[match.re.groups] if match else ""
        if block and (not alone or is_doc != documentation):
            yield from ((n, t, documentation) for n, t in paragraphs(block))
            block = []
        if alone:
            documentation = is_doc
            block.append((number, "" if said.startswith("   ") else said))
        elif match:
            block, documentation = [(number, said)], is_doc


def source_faults(name: str, text: str) -> list[Fault]:
    faults = []
    for number, comment, documentation in comments(name, text):
        faults += phrase_faults(name, number, comment)
        if documentation:
            faults += [Fault("sentences", name, number, s) for s in long_sentences(plain(comment))]
    return faults


def all_faults(root: Path) -> list[Fault]:
    faults = []
    written = pages.pages(root)
    here = Path(__file__).resolve()
    for name in pages.tracked(root):
        is_page, is_source = name in written, name.endswith(SOURCES)
        stored = name.startswith(pages.RESULTS) and not is_page
        if stored or not (is_page or is_source) or (root / name).resolve() == here:
            continue
        text = (root / name).read_text(encoding="utf-8", errors="replace")
        faults += [Fault("lines", name, i, f"{len(line)} characters") for i, line in enumerate(text.splitlines(), 1)
                   if len(line) > LINE and not re.search(r"https?://\S{60}", line)]
        faults += page_faults(name, text) if is_page else source_faults(name, text)
    return faults


def main() -> int:
    root = Path(sys.argv[1]).resolve()
    stored = Path(__file__).with_name("words_allowed.json")
    allowed = json.loads(stored.read_text(encoding="utf-8")) if stored.is_file() else None
    faults = all_faults(root)
    if "--list" in sys.argv:
        prefix = sys.argv[sys.argv.index("--list") + 1] if len(sys.argv) > 3 else ""
        for fault in faults:
            if fault.name.startswith(prefix):
                print(f"{fault.name}:{fault.line}: {fault.kind}: {fault.text}")
        return 0
    counts = collections.Counter((folder_of(f.name), f.kind) for f in faults)
    if "--update" in sys.argv:
        kept = {}
        for (folder, kind), count in sorted(counts.items()):
            most = count if allowed is None else allowed.get(folder, {}).get(kind, 0)
            kept.setdefault(folder, {})[kind] = min(count, most)
        kept = {folder: {k: n for k, n in kinds.items() if n} for folder, kinds in kept.items()}
        stored.write_text(json.dumps({f: k for f, k in kept.items() if k}, indent=1) + "\n", encoding="utf-8")
        allowed = json.loads(stored.read_text(encoding="utf-8"))
    worse = False
    for (folder, kind), count in sorted(counts.items()):
        limit = (allowed or {}).get(folder, {}).get(kind, 0)
        if count > limit:
            worse = True
            print(f"{folder}: {count} {kind}, {limit} allowed; see {Path(__file__).name} {sys.argv[1]} --list {folder}")
            for fault in [f for f in faults if (folder_of(f.name), f.kind) == (folder, kind)][:5 if limit else 20]:
                print(f"  {fault.name}:{fault.line}: {fault.text[:140]}")
        elif count < limit:
            print(f"{folder}: {count} {kind}, fewer than the {limit} allowed: --update stores that")
    print("too much" if worse else f"{sum(counts.values())} faults, none more than allowed")
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
