#!/usr/bin/env python3
"""Compares what kernels use with a committed table.

    resources.py TABLE SOURCE ARCH=LISTING...            exit 0, or 1 with one line per fault
    resources.py TABLE SOURCE ARCH=LISTING... --write    puts what was measured into the table

SOURCE names the part of the table: a .hip file. ARCH is gfx90a (hipcc with clang 15), gfx90a.clang17, sm_90, ...
Its LISTING is AMD's assembly (hipcc -S) or the output of NVIDIA's ptxas -v. Per kernel and architecture the table holds

    registers       at most this many (AMD: vector registers, accumulation registers too)
    scratch_bytes   exactly this much private memory per thread (NVIDIA: stack frame)
    spills          registers spilled to memory (NVIDIA: bytes); 0 where it is not said

and per source

    forbidden       instructions, by the beginning of their names, that may not be in AMD's assembly
    private_memory  parts of the names of kernels with arrays per thread. Others may have private memory on NVIDIA only,
                    for registers that launch bounds do not allow (spills); --write does not accept more
    shared_memory   parts of the names of kernels that declare shared memory. AMD's compiler moves small arrays there,
                    for as many threads as a block may have, and then few blocks fit

An architecture that the table does not know is printed and not compared. NVIDIA's numbers are those of CUDA 13.0.
"""
import argparse
import json
import re
import subprocess
import sys
from pathlib import Path

DEFAULTS = {'forbidden': ['flat_load', 'flat_store', 'flat_atomic'], 'private_memory': [], 'shared_memory': []}
COLUMNS = ['kernel', 'arch', 'registers', 'at most', 'sgprs', 'scratch', 'expected', 'shared', 'spills']


def demangled(names):
    """{mangled: name without parameters and return type}"""
    names = list(names)
    output = subprocess.run(['c++filt'], input='\n'.join(names), capture_output=True, text=True, check=True).stdout
    return {name: short(text) for name, text in zip(names, output.splitlines())}


def short(signature):
    """hiprt::follow<64u> of 'void hiprt::follow<64u>(unsigned int const*)'."""
    depth = 0
    for end in range(len(signature) - 1, -1, -1):
        depth += {')': 1, '(': -1}.get(signature[end], 0)
        if depth == 0:
            break
    return re.sub(r'^void ', '', signature[:end] if signature.endswith(')') else signature)


def read_amd(text):
    """{mangled kernel: usage} from the metadata at the assembly's end."""
    metadata = re.search(r'^amdhsa\.kernels:\n(.*?)^amdhsa\.', text, re.S | re.M)
    if not metadata:
        raise SystemExit('no list of kernels in the assembly')
    kernels = {}
    # Each kernel is an element of the outermost list.
    for block in re.split(r'^  - ', metadata[1], flags=re.M)[1:]:
        field = dict(re.findall(r'^(?:    )?\.(\w+):[ \t]*(\S+)$', block, re.M))
        kernels[field['name']] = {
            'registers': int(field['vgpr_count']),
            'sgprs': int(field['sgpr_count']),
            'scratch_bytes': int(field['private_segment_fixed_size']),
            'shared_bytes': int(field['group_segment_fixed_size']),
            'spills': int(field['vgpr_spill_count']),
        }
    return kernels


def read_nvidia(text):
    """{mangled kernel: usage} from what ptxas -v printed."""
    kernels = {}
    for part in text.split("Compiling entry function '")[1:]:
        name = part[:part.index("'")]
        # Functions that the kernel calls have lines like these of their own.
        frame = re.search(rf'properties for {name}\n\s*(\d+) bytes stack frame, (\d+) bytes spill stores', part)
        shared = re.search(r'(\d+) bytes smem', part)
        kernels[name] = {
            'registers': int(re.search(r'Used (\d+) registers', part)[1]),
            'sgprs': None,
            'scratch_bytes': int(frame[1]),
            'shared_bytes': int(shared[1]) if shared else 0,
            'spills': int(frame[2]),
        }
    return kernels


def instructions(text):
    """Yields (mangled function, instruction) of AMD's assembly."""
    function = None
    for line in text.splitlines():
        label = re.match(r'([A-Za-z_]\w*):', line)
        if label:
            function = label[1]
        instruction = re.match(r'\t([a-z]\w*)', line)
        if instruction:
            yield function, instruction[1]


def measure(listings):
    """(usage as {kernel: {arch: usage}}, instructions as {arch: {(function, instruction): count}})"""
    usage, used = {}, {}
    for listing in listings:
        arch, _, path = listing.partition('=')
        text = Path(path).read_text(encoding='utf-8')
        kernels = read_amd(text) if arch.startswith('gfx') else read_nvidia(text)
        if not kernels:
            raise SystemExit(f'no kernel found in {path}')
        found = list(instructions(text)) if arch.startswith('gfx') else []
        names = demangled(sorted(set(kernels) | {function for function, _ in found if function}))
        for mangled, values in kernels.items():
            usage.setdefault(names[mangled], {})[arch] = values
        counts = used.setdefault(arch, {})
        for function, instruction in found:
            key = names.get(function, '?'), instruction
            counts[key] = counts.get(key, 0) + 1
    return usage, used


def is_needless(part, kernel, arch, values):
    """Whether private memory is there that neither arrays nor spilled registers of NVIDIA's need."""
    if values['scratch_bytes'] == 0 or any(name in kernel for name in part['private_memory']):
        return False
    return arch.startswith('gfx') or values['spills'] == 0


def compare(source, part, usage, used):
    """Yields the faults."""
    limits = part['kernels']
    known = {arch for kernel in limits.values() for arch in kernel}
    archs = set(used)
    for kernel, measured in usage.items():
        for arch, values in measured.items():
            if arch not in known:
                continue
            wanted = limits.get(kernel, {}).get(arch)
            where = f'{source}: {kernel}, {arch}'
            if wanted is None:
                yield f'{where}: not in the table'
                continue
            if values['registers'] > wanted['registers']:
                yield f"{where}: {values['registers']} registers, at most {wanted['registers']} expected"
            if is_needless(part, kernel, arch, values):
                yield f"{where}: scratch_bytes {values['scratch_bytes']}, but it has no array"
            if values['shared_bytes'] != 0 and not any(name in kernel for name in part.get('shared_memory', [])):
                yield f"{where}: shared_bytes {values['shared_bytes']}, but it declares no shared memory"
            for key in ('scratch_bytes', 'spills'):
                if values[key] != wanted.get(key, 0):
                    yield f"{where}: {key} {values[key]}, {wanted.get(key, 0)} expected"
    for kernel, wanted in limits.items():
        for arch in archs & set(wanted):
            if arch not in usage.get(kernel, {}):
                yield f'{source}: {kernel}, {arch}: in the table, but not in the program'
    for arch, counts in sorted(used.items()):
        for (function, instruction), count in sorted(counts.items()):
            if any(instruction.startswith(prefix) for prefix in part['forbidden']):
                yield f'{source}: {function}, {arch}: {count} x {instruction}, which is forbidden'


def print_table(part, usage):
    rows = [COLUMNS]
    for kernel, measured in sorted(usage.items()):
        for arch, values in measured.items():
            wanted = part['kernels'].get(kernel, {}).get(arch, {})
            cells = [kernel, arch, values['registers'], wanted.get('registers', '-'), values['sgprs'],
                     values['scratch_bytes'], wanted.get('scratch_bytes', '-'), values['shared_bytes'],
                     values['spills']]
            rows.append(['-' if cell is None else str(cell) for cell in cells])
    widths = [max(len(row[i]) for row in rows) for i in range(len(COLUMNS))]
    for row in rows:
        print('  '.join(cell.ljust(w) if i < 2 else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths))))


def write(path, table, source, usage, archs):
    """Replaces the numbers of the architectures that were measured."""
    part = table['sources'].setdefault(source, {**DEFAULTS, 'kernels': {}})
    old, part['kernels'] = part['kernels'], {}
    for kernel in sorted(set(old) | set(usage)):
        entry = {arch: limits for arch, limits in old.get(kernel, {}).items() if arch not in archs}
        for arch, values in usage.get(kernel, {}).items():
            entry[arch] = {key: values[key] for key in ('registers', 'scratch_bytes')}
            if values['spills']:
                entry[arch]['spills'] = values['spills']
        if entry:
            part['kernels'][kernel] = dict(sorted(entry.items()))
    text = json.dumps(table, indent=2)
    # One line per architecture.
    text = re.sub(r'\{\s*("registers"[^}]*?)\s*\}', lambda m: '{' + re.sub(r'\s+', ' ', m[1]) + '}', text)
    text = re.sub(r'\[\s*([^\]]*?)\s*\]', lambda m: '[' + re.sub(r'\s+', ' ', m[1]) + ']', text)
    path.write_text(text + '\n', encoding='utf-8')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('table', type=Path)
    parser.add_argument('source')
    parser.add_argument('listings', nargs='+', metavar='ARCH=LISTING')
    parser.add_argument('--write', action='store_true')
    arguments = parser.parse_args()
    table = json.loads(arguments.table.read_text(encoding='utf-8')) if arguments.table.exists() else {'sources': {}}
    usage, used = measure(arguments.listings)
    if arguments.write:
        write(arguments.table, table, arguments.source, usage, set(used))
    part = table['sources'].get(arguments.source)
    if part is None:
        print(f'{arguments.source} is not in {arguments.table}; --write puts it there')
        return 1
    print_table(part, usage)
    faults = list(compare(arguments.source, part, usage, used))
    print('\n'.join(faults) or 'all within the table')
    return int(bool(faults))


if __name__ == '__main__':
    sys.exit(main())
