"""Measure the simulator against its targets and print one table.

    python tools/check.py [case ...] [--quick]

The exit status is 1 when a figure misses its target. No time is measured.
"""

import argparse
import sys
from importlib import import_module

import warp as wp
from checks import table

CASES = "collision", "weight", "surface", "scenes", "energy", "bowl"


def main() -> int:
    """Run the cases and print their rows as they come."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", metavar="case", help=f"of {', '.join(CASES)}; or all")
    parser.add_argument("--quick", action="store_true", help="fewer configurations, shorter runs")
    args = parser.parse_args()
    unknown = set(args.cases) - set(CASES)
    if unknown:
        parser.error(f"no case {', '.join(sorted(unknown))}; there are {', '.join(CASES)}")
    wp.config.log_level = wp.LOG_WARNING
    print(table.head())
    missed = 0
    for case in args.cases or CASES:
        for row in import_module(f"checks.{case}").run(args.quick):
            print(row, flush=True)
            missed += not row.ok
    print(f"{missed} missed" if missed else "all met")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
