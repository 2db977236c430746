#!/usr/bin/env python3
"""Checks how much each public header adds to a program that includes it.

    header_budget.py ROOT TABLE [--compiler g++] [--write]

TABLE has for each header:

    own_headers       number of files of this project that it includes, directly or not
    standard_headers  number of other files that these include directly
    lines             lines after preprocessing, without blank lines and line markers

The first must be exactly the table's. The others depend on the standard library: if the compiler's major version is the
table's, standard_headers must be exactly the table's and lines within 2 % of it. Else standard_headers may not be more,
and lines are not compared. --write puts what was measured into TABLE.

Exit status: 0, 1 (a header costs more or less than the table says), 2 (wrong arguments), 77 (no such compiler).
"""
import argparse
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

TOLERANCE = 0.02


def public_headers(root):
    """What a host program may include; headers of hiprt_build/gpu need a GPU's compiler or runtime."""
    found = ['hiprt_device/hiprt_device.h', 'hiprt_device/primitives/scene_shapes.h', 'hiprt_device/scene_view.h',
             'hiprt/hiprt_types.h', 'hiprt/hiprt_device.h']
    for pattern in ('hiprt_build/*.h', 'hiprt_build/format/validate.h', 'hiprt_build/format/view.h'):
        found += [os.path.relpath(path, root) for path in sorted(glob.glob(os.path.join(root, pattern)))]
    return found


def measure(compiler, root, header):
    with tempfile.TemporaryDirectory() as folder:
        source = os.path.join(folder, 'source.cpp')
        with open(source, 'w', encoding='utf-8') as f:
            f.write(f'#include <{header}>\n')
        result = subprocess.run([compiler, '-std=c++20', f'-I{root}', f'-I{root}/hiprt_device/compat', '-H',
                                 '-E', source],
                                capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f'{header} does not compile:\n{result.stderr}')
    lines = sum(1 for line in result.stdout.splitlines() if line.strip() and not line.startswith('#'))
    own, standard, ancestors = set(), set(), []
    for dots, path in re.findall(r'^(\.+) (\S+)$', result.stderr, re.M):
        depth = len(dots)
        del ancestors[depth - 1:]
        mine = os.path.abspath(path).startswith(root + os.sep)
        if mine:
            own.add(path)
        elif not ancestors or ancestors[-1]:
            standard.add(path)
        ancestors.append(mine)
    return {'own_headers': len(own), 'standard_headers': len(standard), 'lines': lines}


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('root')
    parser.add_argument('table')
    parser.add_argument('--compiler', default='g++')
    parser.add_argument('--write', action='store_true')
    options = parser.parse_args(arguments)
    root = os.path.abspath(options.root)
    if not shutil.which(options.compiler):
        print(f'SKIPPED: {options.compiler} not found')
        return 77
    version = subprocess.run([options.compiler, '-dumpversion'], capture_output=True, text=True, check=True).stdout
    major = int(version.split('.')[0])
    measured = {header: measure(options.compiler, root, header) for header in public_headers(root)}
    if options.write:
        with open(options.table, 'w', encoding='utf-8') as f:
            rows = ',\n'.join(f'    {json.dumps(name)}: {json.dumps(cost)}' for name, cost in measured.items())
            f.write(f'{{\n  "compiler": "{options.compiler}",\n  "major_version": {major},\n'
                    f'  "headers": {{\n{rows}\n  }}\n}}\n')
        return 0
    with open(options.table, encoding='utf-8') as f:
        table = json.load(f)
    compares_lines = table['compiler'] == options.compiler and table['major_version'] == major
    faults = [f'{name}: in the table, but not a public header' for name in table['headers'] if name not in measured]
    for name, cost in measured.items():
        allowed = table['headers'].get(name)
        if allowed is None:
            faults.append(f'{name}: not in the table')
            continue
        for key in ('own_headers', 'standard_headers'):
            fewer_may_be = key == 'standard_headers' and not compares_lines
            if cost[key] > allowed[key] or (cost[key] < allowed[key] and not fewer_may_be):
                faults.append(f'{name}: {cost[key]} {key}, the table says {allowed[key]}')
        if compares_lines and abs(cost['lines'] - allowed['lines']) > TOLERANCE * allowed['lines']:
            faults.append(f'{name}: {cost["lines"]} preprocessed lines, the table says {allowed["lines"]}')
    for fault in faults:
        print(fault)
    what = 'headers and lines' if compares_lines else f'headers (lines are those of g++ {table["major_version"]})'
    print(f'{len(measured)} public headers, {what} compared, {len(faults)} differ')
    return int(bool(faults))


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
