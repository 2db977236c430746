"""test_tidy.py ROOT: tools/tidy sees faults in sources and headers, and remembers what is clean as long as it is."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

CONFIG = "Checks: '-*,modernize-use-nullptr{}'\nWarningsAsErrors: '*'\nHeaderFilterRegex: '/tools/.*'\n"
FAULT = "inline int* pointer() { return 0; }\n"
CLEAN = "inline int* pointer() { return nullptr; }\n"


class Clone:
    def __init__(self, script, work, name):
        self.script, self.root = script, work / name
        self.environment = {**os.environ, "XDG_CACHE_HOME": str(work / "cache")}
        (self.root / "build").mkdir(parents=True)
        (self.root / "tools").mkdir()
        self.write("tools/a.h", CLEAN)
        self.write("tools/a.cpp", '#include "a.h"\nint main() { return pointer() == nullptr ? 0 : 1; }\n')
        self.write("tools/b.cpp", "int b() { return 1; }\n")
        self.write(".clang-tidy", CONFIG.format(""))
        # tools/tidy checks the first of the two variants of a.cpp, without precompiled headers, and no source in other
        # folders.
        commands = [("tools/a.cpp", ["-include", "no/cmake_pch.hxx"]), ("tools/a.cpp", ["-DNO_SUCH=("]),
                    ("tools/b.cpp", []), ("other/c.cpp", [])]
        entries = [{"directory": str(self.root / "build"), "file": str(self.root / file),
                    "command": " ".join(["ccache", "/usr/bin/c++", *more, "-c", str(self.root / file)])}
                   for file, more in commands]
        self.write("build/compile_commands.json", json.dumps(entries))

    def write_unity(self):
        """Both sources of tools/ are compiled as one, as CMake does it."""
        unity = self.root / "build/unity_0_cxx.cxx"
        self.write("build/unity_0_cxx.cxx", "".join(f'#include "{self.root}/tools/{x}.cpp"\n\n' for x in "ab"))
        entry = {"directory": str(self.root / "build"), "file": str(unity),
                 "command": f"/usr/bin/c++ -o unity_0_cxx.cxx.o -c {unity}"}
        self.write("build/compile_commands.json", json.dumps([entry]))

    def write(self, name, text):
        path = self.root / name
        path.write_text(text)
        # Long ago: what has just been written is not remembered, because it may still change.
        os.utime(path, (1e9, 1e9))

    def git(self, *arguments):
        name = ["-c", "user.name=test", "-c", "user.email=test@localhost"]
        subprocess.run(["git", "-C", self.root, *name, *arguments], check=True, capture_output=True)

    def expect(self, status, known, faults, said="", sources=2, more=(), left_out=""):
        done = subprocess.run([self.script, self.root / "build", "tools", "--root", self.root, *more],
                              capture_output=True, text=True, env=self.environment)
        counts = f"{sources} sources, {known} of them known to be clean, {faults} with faults{left_out}\n"
        if done.returncode != status or not done.stdout.endswith(counts) or not re.search(said, done.stdout):
            sys.exit(f"expected status {status}, '{said}' and '{counts}', got {done.returncode}:\n"
                     f"{done.stdout}{done.stderr}")


def main():
    if shutil.which("clang-tidy") is None:
        print("SKIPPED: clang-tidy not found")
        return 77
    script = pathlib.Path(sys.argv[1]) / "tools/tidy"
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder).resolve()
        clone = Clone(script, work, "clone")
        clone.expect(0, known=0, faults=0)
        clone.expect(0, known=2, faults=0)
        Clone(script, work, "another").expect(0, known=2, faults=0)
        clone.write("tools/a.h", FAULT)
        for _ in range(2):
            clone.expect(1, known=1, faults=1, said=r"tools/a\.cpp:\n(.*\n)*.*tools/a\.h:1:\d+: error: use nullptr")
        clone.write("tools/a.h", CLEAN)
        clone.expect(0, known=2, faults=0)
        clone.write(".clang-tidy", CONFIG.format(",bugprone-*"))
        clone.expect(0, known=0, faults=0)
        unity = Clone(script, work, "unity")
        unity.write_unity()
        unity.expect(0, known=0, faults=0)
        unity.write("tools/a.h", FAULT)
        unity.expect(1, known=1, faults=1, said=r"tools/a\.cpp:\n(.*\n)*.*tools/a\.h:1:\d+: error: use nullptr")
        # Since a commit: neither comments nor spaces are code. A header stands for one source that includes it.
        clone.git("init", "-q")
        clone.git("add", "tools")
        clone.git("commit", "-qm", "one")
        since = ["--since", "HEAD"]
        clone.write("tools/a.h", "// Why.\n" + CLEAN.replace(" return", "  return"))
        clone.expect(0, known=0, faults=0, sources=0, more=since)
        clone.write("tools/a.h", CLEAN.replace("pointer", "other"))
        clone.expect(1, known=0, faults=1, sources=1, more=since, said="pointer")
        # Changes that are not committed come first, then those of the newest commit.
        clone.write("tools/a.h", CLEAN)
        clone.write("tools/a.cpp", '#include "a.h"\nint main() { return *pointer(); }\n')
        clone.git("commit", "-qam", "two")
        clone.write("tools/b.cpp", "int b() { return 2; }\n")
        clone.git("commit", "-qam", "three")
        newest = ["--since", "HEAD~2", "--most", "1"]
        left_out = "; left out: 1 of older changes"
        clone.expect(0, known=0, faults=0, sources=1, more=newest, left_out=left_out)
        clone.write("tools/a.cpp", '#include "a.h"\nint main() { return *pointer() + 1; }\n')
        clone.expect(0, known=0, faults=0, sources=1, more=newest, left_out=left_out)
        clone.expect(0, known=2, faults=0, more=newest[:-1] + ["2"])
        clone.write("tools/b.cpp", "int b() { return }\n")
        clone.expect(1, known=1, faults=1, said="expected expression")
        for arguments, message in ((["nowhere", "tools"], "nowhere/compile_commands.json"),
                                   ([str(clone.root / "build"), "tools", "--root", str(clone.root), "--clang-tidy",
                                     "no-such-tidy"], "no-such-tidy is not here"),
                                   ([str(clone.root / "build"), "tools", "--most", "1"], "--most needs --since")):
            done = subprocess.run([script, *arguments], capture_output=True, text=True)
            if done.returncode != 2 or message not in done.stderr:
                sys.exit(f"expected status 2 and '{message}', got {done.returncode}: {done.stderr}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
