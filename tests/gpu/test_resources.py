#!/usr/bin/env python3
"""test_resources.py ARCH=LISTING...: resources.py accepts what it wrote, and sees each fault in a table."""
import copy
import json
import subprocess
import sys
import tempfile
from pathlib import Path

LISTINGS = sys.argv[1:]
SOURCE = 'source.hip'
TOOL = Path(__file__).with_name('resources.py')
faults = 0


def run(table, *options):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'table.json'
        if table is not None:
            path.write_text(json.dumps(table), encoding='utf-8')
        command = [sys.executable, '-B', TOOL, path, SOURCE, *LISTINGS, *options]
        result = subprocess.run(command, capture_output=True, text=True)
        return result.returncode, result.stdout, json.loads(path.read_text(encoding='utf-8')) if path.exists() else None


def expect(what, status, text, table, *options):
    global faults
    actual, output, written = run(table, *options)
    if actual != status or text not in output:
        print(f'FAILED: {what}: exit status {actual} (wanted {status}), output (wanted "{text}"):\n{output}')
        faults += 1
    return written


def changed(table, change):
    result = copy.deepcopy(table)
    part = result['sources'][SOURCE]
    kernel = sorted(part['kernels'])[0]
    arch = sorted(part['kernels'][kernel])[0]
    change(part, kernel, arch)
    return result


def no_arrays(part, kernel, arch):
    part['private_memory'] = []


def no_shared(part, kernel, arch):
    part['shared_memory'] = []


expect('a new table: arrays must be named', 1, 'but it has no array', None, '--write')
empty = {'sources': {SOURCE: {'forbidden': ['flat_'], 'private_memory': ['follow<'],
                              'shared_memory': ['block_maximum'], 'kernels': {}}}}
good = expect('a table without numbers', 0, 'all within', empty, '--write')
expect('the same again', 0, 'all within', good)
expect('no table', 1, 'is not in', None)


def fault(what, text, change, status=1):
    expect(what, status, text, changed(good, change))


def one_less(part, kernel, arch):
    part['kernels'][kernel][arch]['registers'] -= 1


def one_more(part, kernel, arch):
    part['kernels'][kernel][arch]['registers'] += 1


def other_scratch(part, kernel, arch):
    part['kernels'][kernel][arch]['scratch_bytes'] += 4


def spills(part, kernel, arch):
    part['kernels'][kernel][arch]['spills'] = 2


def no_kernel(part, kernel, arch):
    del part['kernels'][kernel]


def ghost(part, kernel, arch):
    part['kernels']['ghost'] = {arch: {'registers': 1, 'scratch_bytes': 0}}


def no_arch(part, kernel, arch):
    for limits in part['kernels'].values():
        limits.pop(arch, None)


def forbid(part, kernel, arch):
    part['forbidden'] = ['s_endp']


fault('too many registers', 'registers, at most', one_less)
fault('fewer registers than allowed', 'all within', one_more, 0)
fault('other scratch', 'scratch_bytes', other_scratch)
fault('private memory without arrays', 'but it has no array', no_arrays)
fault('undeclared shared memory', 'declares no shared memory', no_shared)
fault('other spills', 'spills 0, 2 expected', spills)
fault('a kernel that the table lacks', 'not in the table', no_kernel)
fault('a kernel that is gone', 'ghost', ghost)
fault('an architecture without limits', 'all within', no_arch, 0)
if any(listing.startswith('gfx') for listing in LISTINGS):
    fault('a forbidden instruction', 's_endpgm, which is forbidden', forbid)
repaired = expect('--write repairs', 0, 'all within', changed(good, one_less), '--write')
if repaired != good:
    print('FAILED: --write does not restore the table')
    faults += 1
print(f'{faults} faults')
sys.exit(faults != 0)
