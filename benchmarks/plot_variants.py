#!/usr/bin/env python3
"""Turns JSON of bench_variants into a summary in Markdown and plots. See --help."""

import argparse
import os
import sys

from variant_report.plots import plot_all
from variant_report.runs import Peers, Runs
from variant_report.script import Parser, run_script, write_together
from variant_report.summary import summary

DESCRIPTION = """Writes variants.md (comparison with other libraries, cost of accuracy and of features) and plots (SVG,
if matplotlib is installed) from JSON of bench_variants. Exit status: 0; 1 when a file cannot be read or written or has
another format (nothing is written then); 2 for a wrong argument."""


def count(text):
    """An argument: a number of variants."""
    if not (text.isascii() and text.isdigit() and 1 <= len(text) <= 3 and int(text) > 0):
        raise argparse.ArgumentTypeError(f"'{text}' is no number from 1 to 999")
    return int(text)


def write_report(runs, peers, most, folder):
    # Text of the JSON, such as a command, may contain characters without an encoding.
    with open(os.path.join(folder, "variants.md"), "w", encoding="utf-8", errors="backslashreplace") as file:
        file.write(summary(runs, peers))
    plot_all(runs, folder, most, peers.vulkan())


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    parser = Parser(prog="plot_variants.py", description=DESCRIPTION)
    parser.add_argument("json", nargs="+", help="files of bench_variants --json; compressed ones end in .xz")
    parser.add_argument("--output", default=".", help="folder for the output (.)")
    parser.add_argument("--peers", nargs="+", default=[os.path.join(here, "peers", "h200.json")],
                        help="figures of the other libraries (h200.json), also those of bench_variants --vulkan-json")
    parser.add_argument("--most", type=count, default=30, help="number of best variants in the plot of a scene (30)")
    arguments = parser.parse_args()

    def work():
        runs, peers = Runs(arguments.json), Peers(*arguments.peers)
        write_together("plot_variants", arguments.output,
                       lambda folder: write_report(runs, peers, arguments.most, folder))

    return run_script("plot_variants", work)


if __name__ == "__main__":
    sys.exit(main())
