"""Measure the simulator against closed forms and targets, and print one table.

    python tools/verify.py [case ...] [--quick]

A figure with a closed form is an error against an exact value and reaches a level: good, excellent,
best; one with a target is ok within it. A case holds what all of its figures hold. The exit status
is 1 when one is missed. No time is measured.
"""

import sys
from functools import partial
from pkgutil import resolve_name

from measure import machine, report
from measure.figure import lowest
from measure.run import command_line, one_of, run, status

CASES = {  # title, where the figures come from
    "springs": ("A1 series springs", "springs.run"),
    "stack": ("A1 stack of cubes", "springs.stack"),
    "collision": ("A6 free collision", "collision.run"),
    "weight": ("A7 static weight", "weight.run"),
    "ladder": ("A7m mass ladder", "weight.ladder"),
    "friction": ("A5 Coulomb friction", "friction.run"),
    "bars": ("A4 impact of bars", "bars.run"),
    "patch": ("A2 contact patch test", "patch.run"),
    "hertz": ("A3 Hertz, spheres", "hertz.run"),
    "cylinder": ("A3 Hertz, cylinder", "hertz.cylinder"),
    "facets": ("A9 sliding over facets", "facets.run"),
    "orders": ("A8 orders of convergence", "orders.run"),
    "surface": ("stage 4 alone", "surface.run"),
    "energy": ("damping", "energy.run"),
    "scenes": ("scenes of the paper", "scenes.run"),
    "bowl": ("bowl of fruit", "scenes.bowl"),
}


def main() -> int:
    """Run the cases and print their figures as they come."""
    parser = command_line(__doc__)
    names = f"of {', '.join(CASES)}; or all"
    parser.add_argument("cases", nargs="*", metavar="case", type=one_of(CASES), help=names)
    parser.add_argument("--quick", action="store_true", help="fewer variants, coarser meshes")
    args = parser.parse_args()
    print(machine.line(), "", report.FIGURES.head(), sep="\n")
    chosen = [CASES[name] for name in args.cases or CASES]
    cases = {title: resolve_name(f"verification.{where}") for title, where in chosen}
    found = run({title: partial(case, args.quick) for title, case in cases.items()})
    print("", *(f"{title}: {lowest(kept)}" for title, kept in found.items()), sep="\n")
    return status(found)


if __name__ == "__main__":
    sys.exit(main())
