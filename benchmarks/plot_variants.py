#!/usr/bin/env python3
"""Turns JSON of bench_variants into a summary in Markdown and plots. See --help."""

import argparse
import os
import sys

from variant_report.plots import plot_all
from variant_report.runs import Peers, Runs
from variant_report.summary import summary


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    parser = argparse.ArgumentParser(
        description="Writes variants.md (comparison with the peers, cost of accuracy and of features) and plots (PNG and "
        "SVG; left out where matplotlib is missing) from JSON of bench_variants. Exit status 1 if a file cannot be read.")
    parser.add_argument("json", nargs="+", help="files of bench_variants --json")
    parser.add_argument("--output", default=".", help="folder for what is written (.)")
    parser.add_argument("--peers", default=os.path.join(here, "peers", "h200.json"), help="the peers' figures (h200.json)")
    parser.add_argument("--most", type=int, default=30, help="variants in the plot of a scene, the best ones (30)")
    arguments = parser.parse_args()
    try:
        runs, peers = Runs(arguments.json), Peers(arguments.peers)
    except (OSError, ValueError, KeyError) as error:
        print(f"plot_variants.py: {error}", file=sys.stderr)
        return 1
    os.makedirs(arguments.output, exist_ok=True)
    with open(os.path.join(arguments.output, "variants.md"), "w", encoding="utf-8") as file:
        file.write(summary(runs, peers))
    plot_all(runs, arguments.output, arguments.most)
    return 0


if __name__ == "__main__":
    sys.exit(main())
