#!/usr/bin/env python3
"""Turns JSON of bench_builders into bar charts. See --help."""

import sys

from variant_report.builders import BuilderRuns, plot_builders
from variant_report.plots import load_pyplot
from variant_report.script import Parser, run_script, write_together

DESCRIPTION = """Writes builders_trace_times, builders_build_times_and_cost and, if that scene was measured,
builders_opera_house (SVG) from JSON of bench_builders: geometric means over the scenes from files, or over 'procedural'
without such scenes. Without matplotlib it writes nothing. Exit status: 0; 1 when a file cannot be read or written or
has another format (nothing is written then); 2 for a wrong argument."""


def main():
    parser = Parser(prog="plot_builders.py", description=DESCRIPTION)
    parser.add_argument("json", help="file of bench_builders --benchmark_out")
    parser.add_argument("--output", default=".", help="folder for the plots (.)")
    arguments = parser.parse_args()

    def work():
        runs = BuilderRuns(arguments.json)
        plt = load_pyplot("plot_builders.py")
        if plt is not None:
            write_together("plot_builders", arguments.output, lambda folder: plot_builders(plt, runs, folder))

    return run_script("plot_builders", work)


if __name__ == "__main__":
    sys.exit(main())
