"""Where the simulator stops working: small scenes that try to break it, and maps of the frontier.

    python tools/stability.py cases [family ...] [--response NAME] [--only TEXT]
    python tools/stability.py map [sweep ...] [--out DIR]

``cases`` prints the outcome of every scene and the level it holds; the exit status is 1 when one
holds none. ``map`` runs its cells in processes and writes ``map.csv``, a row per cell, and a heat
map per sweep (needs the extra ``plot``); a cell that fails is a result there. The outcomes:
tools/trials/outcome.py.
"""

import sys
from pathlib import Path

from measure.figure import MISSED
from measure.report import Table
from measure.run import command_line, one_of
from trials import degenerate, figures, limits, loads, shapes
from trials.outcome import classify, level
from trials.sweeps import SWEEPS
from trials.watch import METHODS, attempt

FAMILIES = {
    "limits": limits.cases,  # B10 what the method was not made for
    "speed": loads.speed,  # B9 speed and tunnelling
    "ratios": loads.ratios,  # B3 mass and stiffness ratios
    "figures": figures.cases,  # B4, B6, B7 the scenes of the paper
    "primitives": shapes.primitives,  # B2 primitive pairs
    "tilts": figures.tilts,  # B2 blocks at random tilts
    "spikes": shapes.spikes,  # B1 spikes, wedges, edges, holes
    "degenerate": degenerate.cases,  # B11 degenerate input
}
COLUMNS = {"case": 48, "outcome": 10, "overlap": 8, "gained": 8, "lowest": 9, "volume": 9}
TABLE = Table(**COLUMNS, passed=7, steps=7, level=9, reason=0)
OUT = Path(__file__).parent / "results" / "stability"


def main() -> int:
    """Run one of the two parts."""
    parser = command_line(__doc__)
    parts = parser.add_subparsers(dest="part", required=True)
    part = parts.add_parser("cases", help="small scenes, an outcome and a level each")
    names = {"nargs": "*", "help": "or all"}
    part.add_argument("names", type=one_of(FAMILIES), metavar="family", **names)
    part.add_argument("--response", choices=METHODS, default=METHODS[0])
    part.add_argument("--only", default="", help="cases whose name has this in it")
    part = parts.add_parser("map", help="two-dimensional sweeps to the point of failure")
    part.add_argument("names", type=one_of(SWEEPS), metavar="sweep", **names)
    part.add_argument("--out", type=Path, default=OUT, help="folder of the table and the pictures")
    args = parser.parse_args()
    if args.part == "map":
        try:
            from trials import maps
        except ImportError:
            print("no matplotlib: pip install 'warp_contact[plot]'", file=sys.stderr)
            return 1
        maps.draw(args.names or list(SWEEPS), args.out)
        return 0
    print(f"response {args.response}\n{TABLE.head()}")
    missed = 0
    for case in (case for family in args.names or FAMILIES for case in FAMILIES[family]()):
        if args.only in case.name:
            r = attempt(case.build, args.response)
            held = level(r, case.expect)
            missed += held == MISSED
            sizes = f"{r.overlap:.2%}", f"{r.gained:.2%}", f"{r.lowest:.3g}", f"{r.volume:.3g}"
            counts = str(r.tunnelled), str(r.steps)
            print(TABLE.line(case.name, classify(r), *sizes, *counts, held, r.reason), flush=True)
    print(f"{missed} missed" if missed else "all met")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
