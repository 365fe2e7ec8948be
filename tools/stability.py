"""Where the simulator stops working: small scenes that try to break it, and maps of the frontier.

    python tools/stability.py cases [family ...] [--quick] [--response NAME]
    python tools/stability.py map [sweep ...] [--quick] [--out DIR]

``cases`` prints the outcome of every scene and the level it holds; the exit status is 1 when one
holds none. ``map`` writes ``map.csv``, a row per cell, and a heat map per sweep (needs the extra
``plot``); a cell that fails is a result there. The outcomes: tools/stable/outcome.py.
"""

import argparse
import sys
from importlib import import_module
from pathlib import Path

import warp as wp
from trials.outcome import MISSED, classify, level
from trials.setup import METHODS, attempt

FAMILIES = {
    "limits": "B10 what the method was not made for",
    "speed": "B9 speed and tunnelling",
    "ratios": "B3 mass and stiffness ratios",
    "figures": "B4 to B7 the scenes of the paper",
    "primitives": "B2 primitive pairs",
    "tilts": "B2 blocks at random tilts",
    "spikes": "B1 spikes, wedges, edges, holes",
    "degenerate": "B11 degenerate input",
}
WIDTHS = 48, 10, 8, 8, 9, 9, 7, 7, 9  # [characters]
OUT = Path(__file__).parent / "results" / "stability"


def main() -> int:
    """Run one of the two parts."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parts = parser.add_subparsers(dest="part", required=True)
    part = parts.add_parser("cases", help="small scenes, an outcome and a level each")
    part.add_argument("names", nargs="*", metavar="family", help=f"of {', '.join(FAMILIES)}")
    part.add_argument("--response", choices=METHODS, default=next(iter(METHODS)))
    part.add_argument("--only", default="", help="cases whose name has this in it")
    part.add_argument("--quick", action="store_true", help="fewer cases, shorter runs")
    part = parts.add_parser("map", help="two-dimensional sweeps to the point of failure")
    part.add_argument("names", nargs="*", metavar="sweep", help="step, ratio, depth, speed; or all")
    part.add_argument("--out", type=Path, default=OUT, help="folder of the table and the pictures")
    part.add_argument("--quick", action="store_true", help="5 by 5 cells")
    args = parser.parse_args()
    wp.config.log_level = wp.LOG_WARNING
    if args.part == "map":
        from trials import chart, sweeps

        check(parser, args.names, sweeps.SWEEPS)
        return chart.draw(args.names or list(sweeps.SWEEPS), args.quick, args.out)
    check(parser, args.names, FAMILIES)
    return show(args.names or list(FAMILIES), args)


def check(parser, names, known) -> None:
    """Refuse a name that there is not."""
    unknown = set(names) - set(known)
    if unknown:
        parser.error(f"no {', '.join(sorted(unknown))}; there are {', '.join(known)}")


def show(families: list[str], args) -> int:
    """Run the cases and print them as they come."""
    head = "case", "outcome", "overlap", "gained", "lowest", "volume"
    head += "passed", "steps", "level", "reason"
    line = cells(*head)
    print(f"response {args.response}\n{line}\n{'-' * len(line)}")
    missed = 0
    for family in families:
        for case in import_module(f"trials.{family}").cases(args.quick):
            if args.only not in case.name:
                continue
            r = attempt(case.build, args.response, limit=case.limit)
            found = level(r, case.expect)
            missed += found == MISSED
            numbers = f"{r.overlap:.2%}", f"{r.gained:.2%}", f"{r.lowest:.3g}", f"{r.volume:.3g}"
            reason = r.reason
            counts = str(r.tunnelled), str(r.steps)
            print(cells(case.name, classify(r), *numbers, *counts, found, reason), flush=True)
    print(f"{missed} missed" if missed else "all met")
    return 1 if missed else 0


def cells(*text: str) -> str:
    """One line of the table."""
    padded = (t.ljust(w) for t, w in zip(text, (*WIDTHS, 0), strict=True))
    return "  ".join(padded).rstrip()


if __name__ == "__main__":
    sys.exit(main())
