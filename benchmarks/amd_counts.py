#!/usr/bin/env python3
"""Counts what AMD kernels execute, without an AMD GPU: bench_variants under amdrun --count.

    amd_counts.py [OPTION...] PROGRAM FLAG...

    --arch ARCH      gfx90a, gfx1030 or gfx1100 (gfx1030)
    --amdrun FILE    amdrun (HIPRT_AMDRUN, or ../shared/amdrun/amdrun beside the repository)
    --markdown FILE  writes the tables to a file, too
    --json FILE      writes all counts
    --table FILE     compares instructions of waves per ray with a stored table: exit status 1 where a variant executes
                     over 2 % more
    --write          writes the stored table instead
    --compiler NAME  of the kernels, for the table (clang15)

PROGRAM is bench_variants, compiled for ARCH. FLAGs are its flags, such as --scenes=DIR --width=128 --height=128
--pixels=tiles. Counts do not depend on the machine that emulates. They are no times: amdrun knows no caches and no
latencies. Exit status: 0; 1 where a count is too high or a program fails; 2 for a wrong command line; 77 where amdrun
is not here, or the table knows no count of the compiler.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

AXES = ['query', 'layout', 'tests', 'stack', 'schedule', 'order', 'features', 'blocks', 'answers']
# What names a variant in tables. The order of children follows from the query and the tests.
SHOWN = ['layout', 'tests', 'stack', 'schedule', 'features', 'blocks']
# Classes of amdrun that are vector arithmetic.
VECTOR_CLASSES = ['valu', 'valu_fma', 'valu_trans', 'valu_64', 'valu_dual']
ALLOWED_GROWTH = 1.02


def find_amdrun(given):
    beside = Path(__file__).resolve().parents[2] / 'shared' / 'amdrun' / 'amdrun'
    for path in ([given] if given else [os.environ.get('HIPRT_AMDRUN'), beside]):
        # CMake without amdrun gives an empty name, which is the Path of this folder.
        if path and os.path.isfile(path) and os.access(path, os.X_OK):
            return str(path)
    print('SKIPPED: amdrun is not here (--amdrun, HIPRT_AMDRUN)')
    sys.exit(77)


def run(options):
    """(results of bench_variants, launches of amdrun), in the same order."""
    with tempfile.TemporaryDirectory() as folder:
        counts, results = Path(folder, 'counts'), Path(folder, 'results')
        command = [find_amdrun(options.amdrun), '--arch', options.arch, '--count', str(counts), '--', options.program,
                   *options.flags, '--device=gpu', '--repetitions=1', '--warm-up=0', f'--json={results}']
        if subprocess.run(command, stdout=sys.stderr).returncode != 0 or not (counts.exists() and results.exists()):
            sys.exit('amd_counts.py: failed: ' + ' '.join(command))
        launches = [json.loads(line) for line in counts.read_text().splitlines()]
        found = json.loads(results.read_text())['results']
    if len(launches) != len(found):
        sys.exit(f'amd_counts.py: {len(launches)} launches for {len(found)} results')
    return found, launches


# Per architecture: registers of a SIMD per lane, how many are allocated together, most waves of a SIMD (LLVM's
# AMDGPUBaseInfo).
REGISTER_FILES = {'gfx90a': (512, 8, 8), 'gfx1030': (1024, 16, 16), 'gfx1100': (1536, 24, 16)}


def resident_waves(launch, arch):
    """Waves per SIMD that registers and shared memory leave room for."""
    narrow = launch['wave_size'] == 32
    registers, step, most = REGISTER_FILES[arch]
    by_registers = registers // (-(-max(launch['vgprs'], 1) // step) * step)
    waves = -(-launch['block'][0] // launch['wave_size'])
    # 64 KiB per compute unit; 2 SIMDs each on RDNA, 4 on CDNA.
    by_memory = most
    if launch['lds']:
        by_memory = 65536 // launch['lds'] * waves // (2 if narrow else 4)
    return min(most, by_registers, by_memory)


def measure(result, launch, arch):
    """The figures of one launch. Those of instructions and lines are per ray."""
    rays = result['rays']
    vector = sum(launch[name] for name in VECTOR_CLASSES)
    lines = launch['global_lines128'] + launch['bvh_lines128']
    return {
        'arch': arch, 'kind': result['kind'], **{axis: result[axis] for axis in AXES},
        'scene': result['scene'], 'tree': result['tree'],
        'instructions': launch['instructions'] / rays, 'valu': vector / rays,
        'lanes': launch['valu_lanes'] / vector, 'lines': lines / rays,
        'scratch_lines': launch['scratch_lines128'] / rays, 'shared_conflicts': launch['lds_conflict_cycles'] / rays,
        'registers': launch['vgprs'], 'scratch': launch['scratch'], 'waves': resident_waves(launch, arch),
        'counts': launch}


def name_of(figures):
    return ' '.join(figures[axis] for axis in SHOWN)


def tables(figures, arch):
    """Markdown: one table per scene and tree, one row per variant; kinds of rays beside each other."""
    lines = []
    for scene in dict.fromkeys((f['scene'], f['tree']) for f in figures):
        mine = [f for f in figures if (f['scene'], f['tree']) == scene]
        kinds = list(dict.fromkeys(f['kind'] for f in mine))
        lines += [f'## {scene[0]}.{scene[1]}, {arch}: {" / ".join(kinds)}', '',
                  '| variant | wave instructions | VALU | active lanes | 128-byte lines | lines of scratch '
                  '| registers | scratch bytes | waves |', '|---|---|---|---|---|---|---|---|---|']
        for name in dict.fromkeys(name_of(f) for f in mine):
            row = {f['kind']: f for f in mine if name_of(f) == name}
            cells = [name]
            for key, digits in (('instructions', 0), ('valu', 0), ('lanes', 0), ('lines', 1), ('scratch_lines', 1)):
                cells.append(' / '.join(f'{row[k][key]:.{digits}f}' if k in row else '' for k in kinds))
            for key in ('registers', 'scratch', 'waves'):
                cells.append(', '.join(str(value) for value in dict.fromkeys(f[key] for f in row.values())))
            lines.append('| ' + ' | '.join(cells) + ' |')
        lines.append('')
    return '\n'.join(lines)


def compare(figures, options):
    """0, 1 where a variant executes more than the table allows, or 77."""
    path, compiler = options.table, options.compiler
    now = {f'{compiler} {f["arch"]} {f["scene"]}.{f["tree"]} {f["kind"]} {f["query"]} {name_of(f)}':
           round(f['instructions'], 2) for f in figures}
    stored = json.loads(path.read_text()) if path.exists() else {}
    if options.write:
        path.write_text(json.dumps(dict(sorted({**stored, **now}.items())), indent=1) + '\n')
        return 0
    if not any(name.startswith(compiler + ' ') for name in stored):
        print(f'SKIPPED: {path} knows no count of {compiler}')
        return 77
    faults = 0
    for name, count in now.items():
        if name not in stored:
            print(f'{name}: {count} wave instructions per ray; not in {path} (--write)')
            faults += 1
        elif count > stored[name] * ALLOWED_GROWTH:
            print(f'{name}: {count} wave instructions per ray, at most {stored[name]} + 2 %')
            faults += 1
    print(f'{len(now)} counts, {faults} faults')
    return 1 if faults else 0


def main():
    if sys.argv[1:2] in (['--help'], ['-h']):
        print(__doc__.strip())
        return 0
    parser = argparse.ArgumentParser(usage='amd_counts.py [OPTION...] PROGRAM FLAG... (see --help)', add_help=False)
    parser.add_argument('--arch', default='gfx1030', choices=['gfx90a', 'gfx1030', 'gfx1100'])
    for name in ('--amdrun', '--markdown', '--json', '--table'):
        parser.add_argument(name, type=Path)
    parser.add_argument('--write', action='store_true')
    parser.add_argument('--compiler', default='clang15')
    parser.add_argument('program')
    parser.add_argument('flags', nargs=argparse.REMAINDER)
    options = parser.parse_args()
    if options.write and options.table is None:
        parser.error('--write needs --table')
    results, launches = run(options)
    figures = [measure(result, launch, options.arch) for result, launch in zip(results, launches)]
    text = tables(figures, options.arch)
    print(text)
    if options.markdown:
        options.markdown.write_text(text)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + '\n')
    return compare(figures, options) if options.table else 0


if __name__ == '__main__':
    sys.exit(main())
