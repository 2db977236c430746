#!/usr/bin/env python3
"""test_checkers.py ROOT: test_words.py and test_readme.py see the faults that they are there for."""

import sys
import tempfile
from pathlib import Path

import test_readme
import test_words

PAGE = """# A page

This sentence has a great many words, and it goes on and on about nothing much, until every reader has forgotten how it
began and what it was meant to say about anything.
The table is no longer there; since 8b458ff it is faster, but for a few cases.

| a | b | c | d | e | f | g |
|---|---|---|---|---|---|---|

See [nothing](MISSING.md), [no heading](OTHER.md#nowhere), `tests/no_such_file.cpp` and `noSuchName`.
The test `test_a.cpp "no such case*"` and `test_a.cpp "one*"`.

<!-- file: tests/examples/a.cpp -->
```cpp
int b;
```
""" + "x" * 121 + "\n"
SOURCE = """/// This comment was 0.62 times as long, and it has so many words in one
/// single sentence that nobody who reads it for the first time will understand what it
/// wants to tell about the function below.
int a;  // Those that are not.
"""


def expect(what: str, found: dict, wanted: dict) -> None:
    if found != wanted:
        sys.exit(f"{what}: found {found}, expected {wanted}")


def words(root: Path) -> None:
    counts: dict[tuple[str, str], int] = {}
    for fault in test_words.all_faults(root):
        counts[fault.name, fault.kind] = counts.get((fault.name, fault.kind), 0) + 1
    page, source = "hiprt_device/docs/PAGE.md", "tests/examples/a.cpp"
    expect("test_words.py", counts, {
        (page, "lines"): 1, (page, "sentences"): 1, (page, "diary"): 2, (page, "compressed"): 1, (page, "columns"): 1,
        (source, "sentences"): 1, (source, "diary"): 1, (source, "compressed"): 1})


def readme(root: Path) -> None:
    name = "hiprt_device/docs/PAGE.md"
    text = (root / name).read_text(encoding="utf-8")
    faults = {"blocks": test_readme.block_faults(root, name, text), "links": test_readme.link_faults(root, name, text),
              "tests": test_readme.test_faults(root, name, text), "paths": test_readme.path_faults(root, name, text),
              "names": test_readme.name_faults(root, name, text, {"a", "no_such_file"})}
    expect("test_readme.py", {kind: len(found) for kind, found in faults.items()},
           {"blocks": 1, "links": 2, "tests": 1, "paths": 1, "names": 1})
    test_readme.update(root, name)
    text = (root / name).read_text(encoding="utf-8")
    expect("--update", {"blocks": len(test_readme.block_faults(root, name, text))}, {"blocks": 0})


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder).resolve()
        for name, text in {"hiprt_device/docs/PAGE.md": PAGE, "hiprt_device/docs/OTHER.md": "# Other\n",
                           "tests/examples/a.cpp": SOURCE,
                           "tests/traversal/test_a.cpp": 'TEST_CASE("one case") {}\n'}.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        words(root)
        readme(root)
    print("faults are seen")
    return 0


sys.exit(main())
