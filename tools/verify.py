"""Measure the simulator against closed forms and print one table.

    python tools/verify.py [case ...] [--quick] [--response NAME] [--csv FILE] [--seed N]

Every figure is an error against an exact value and reaches a level: good, excellent, best, or none
("-"). A case holds the level that all of its figures hold. The exit status is 1 when one holds
none. No time is measured.
"""

import argparse
import csv
import sys
from importlib import import_module

import warp as wp
from verification import figure
from verification.setup import RESPONSES, Ask

from warp_contact import SimulationError

CASES = {
    "springs": "A1 series springs",
    "stack": "A1 stack of cubes",
    "collision": "A6 free collision",
    "weight": "A7 static weight",
    "ladder": "A7m mass ladder",
    "friction": "A5 Coulomb friction",
    "bars": "A4 impact of bars",
    "patch": "A2 contact patch test",
    "hertz": "A3 Hertz, spheres",
    "cylinder": "A3 Hertz, cylinder",
    "facets": "A9 sliding over facets",
    "orders": "A8 orders of convergence",
}


def main() -> int:
    """Run the cases and print their figures as they come."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", metavar="case", help=f"of {', '.join(CASES)}; or all")
    parser.add_argument("--quick", action="store_true", help="fewer variants, coarser meshes")
    parser.add_argument("--response", choices=RESPONSES, default=RESPONSES[0])
    parser.add_argument("--csv", metavar="FILE", help="write the figures there too")
    parser.add_argument("--seed", type=int, default=0, help="of the jittered meshes")
    args = parser.parse_args()
    unknown = set(args.cases) - set(CASES)
    if unknown:
        parser.error(f"no case {', '.join(sorted(unknown))}; there are {', '.join(CASES)}")
    wp.config.log_level = wp.LOG_WARNING
    print(f"response {args.response}, SEED={args.seed}\n{figure.head()}")
    ask = Ask(args.quick, args.response, args.seed)
    figures, levels = [], {}
    for case in args.cases or CASES:
        found = list(run(case, ask))
        levels[case] = figure.lowest(found)
        figures += found
    print()
    for case, level in levels.items():
        print(f"{CASES[case]}: {level}")
    if args.csv:
        write(args.csv, args.response, figures)
    return 1 if figure.MISSED in levels.values() else 0


def run(case: str, ask: Ask):
    """The figures of a case, printed as they come; a run that stops is one that holds no level."""
    try:
        for found in import_module(f"verification.{case}").run(ask):
            print(found, flush=True)
            yield found
    except SimulationError as error:
        print(f"{CASES[case]}: {error}")
        yield figure.zero(CASES[case], "stopped early", float("inf"), (0.0, 0.0, 0.0))


def write(path: str, response: str, figures: list) -> None:
    """All figures with all digits."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(("response", *figure.COLUMNS))
        for f in figures:
            out.writerow((response, f.case, f.name, f.value, f.reference, f.error, f.level))


if __name__ == "__main__":
    sys.exit(main())
