"""The pages of the repository: which there are, and what is code or prose in them. For the tests beside this file."""

import re
import subprocess
from pathlib import Path

CODE_BLOCK = re.compile(r"^```.*?^```$\n?", re.DOTALL | re.MULTILINE)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
SPAN = re.compile(r"`([^`\n]+(?:\n[^`\n]+)?)`")
LINK = re.compile(r"!?\[([^\]]*)\]\(([^)\s]+)\)")
HEADING = re.compile(r"^(#+)\s+(.*)$", re.MULTILINE)
RESULTS = "benchmarks/results/"
DOCS = "hiprt_device/docs/"


def tracked(root: Path) -> list[str]:
    """All files that git knows; outside a clone, all files but those of builds."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard"],
                            capture_output=True, text=True)
    if listed.returncode == 0 and listed.stdout:
        names = listed.stdout.splitlines()
    else:
        names = [p.relative_to(root).as_posix() for p in root.rglob("*") if p.is_file()]
    return sorted(n for n in names if not n.startswith("build/") and (root / n).is_file())


def pages(root: Path) -> list[str]:
    """Markdown pages that people write: all but the stored results."""
    return [n for n in tracked(root) if n.endswith(".md") and (not n.startswith(RESULTS) or n == RESULTS + "README.md")]


def guide(root: Path) -> list[str]:
    """README.md and the pages of the documentation."""
    return [n for n in pages(root) if n == "README.md" or n.startswith(DOCS)]


def without_code(text: str) -> str:
    """Blank lines in place of code blocks, so that line numbers stay."""
    return CODE_BLOCK.sub(lambda m: "\n" * m[0].count("\n"), text)


def anchor(heading: str) -> str:
    """What GitHub makes of a heading."""
    text = LINK.sub(r"\1", COMMENT.sub("", heading)).replace("`", "").strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def anchors(text: str) -> list[str]:
    return [anchor(m[2]) for m in HEADING.finditer(without_code(text))]
