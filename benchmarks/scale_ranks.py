#!/usr/bin/env python3
"""Measures bvhrender on several numbers of ranks.

    scale_ranks.py [--program build/release/tools/bvhrender] [--ranks 1,2,4] [--rounds 2] [--mpirun "mpirun ..."]
                   [--json FILE] -- bvhrender's words, without an output

    scale_ranks.py --ranks 1,2,4,8,16 -- bedroom.bvh --camera bedroom.cam --size 960x540 --integrator path --spp 48 \\
      --threads 1 --device cpu

Rounds are interleaved. One rank runs without mpirun, with --taskset on those processors. Prints a table of medians as
Markdown: seconds of the computation (without the start of MPI), the efficiency, and for scenes in parts what went
between ranks, per ray. Ends with 1 if a picture has other bytes than the first. --json stores all runs, one
per line.
"""
import argparse
import hashlib
import json
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
import time


def measure(command, picture):
    begin = time.monotonic()
    told = json.loads(subprocess.run(command + ['-o', picture, '--json'], check=True, stdout=subprocess.PIPE).stdout)
    with open(picture, 'rb') as file:
        digest = hashlib.md5(file.read()).hexdigest()
    rays = told['primary_rays'] + told['secondary_rays'] + told['shadow_rays']
    return {'ranks': told['ranks'], 'device': told['device'], 'seconds': told['seconds'],
            'wall': round(time.monotonic() - begin, 2), 'rays': rays, 'picture': digest, **told['exchange']}


def table(runs):
    lines = ['| ranks | seconds | efficiency (per doubling) | visits per ray | bytes per ray |'
             ' messages per 1000 rays |', '|---:|---:|---:|---:|---:|---:|']
    seconds = {}
    for ranks in sorted({run['ranks'] for run in runs}):
        of = [run for run in runs if run['ranks'] == ranks]
        seconds[ranks] = statistics.median(run['seconds'] for run in of)
        least = min(seconds)
        efficiency = f'{seconds[least] * least / seconds[ranks] / ranks:.2f}'
        if ranks % 2 == 0 and ranks // 2 in seconds:
            efficiency += f' ({seconds[ranks // 2] / seconds[ranks] / 2:.2f})'
        per_ray = [statistics.median(run[key] / run['rays'] for run in of)
                   for key in ('visits_of_other_ranks', 'bytes', 'messages')]
        exchange = f'{per_ray[0]:.2f} | {per_ray[1]:.0f} | {1000 * per_ray[2]:.1f}' if per_ray[2] else '| |'
        lines.append(f'| {ranks} | {seconds[ranks]:.2f} | {efficiency} | {exchange} |')
    return '\n'.join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--program', default='build/release/tools/bvhrender')
    parser.add_argument('--ranks', default='1,2', help='numbers of ranks (default: %(default)s)')
    parser.add_argument('--rounds', type=int, default=2)
    parser.add_argument('--mpirun', default='mpirun --bind-to core', help='with its options (default: %(default)s)')
    parser.add_argument('--taskset', default='0', help='processors of one rank (default: %(default)s)')
    parser.add_argument('--json', help='file for all runs')
    parser.add_argument('words', nargs='+', help='of bvhrender')
    options = parser.parse_args()
    runs = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(options.rounds):
            for ranks in [int(word) for word in options.ranks.split(',')]:
                start = ['taskset', '-c', options.taskset] if ranks == 1 else \
                    shlex.split(options.mpirun) + ['-n', str(ranks)]
                command = start + [options.program] + options.words
                runs.append(measure(command, os.path.join(folder, 'picture.png')))
                print(json.dumps(runs[-1]), file=sys.stderr, flush=True)
    if options.json:
        with open(options.json, 'w', encoding='utf-8') as file:
            file.writelines(json.dumps(run) + '\n' for run in runs)
    print(table(runs))
    if len({run['picture'] for run in runs}) != 1:
        sys.exit('the pictures differ')


if __name__ == '__main__':
    main()
