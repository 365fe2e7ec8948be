"""Switch off one part of the default method at a time: what gets worse, and by how much.

    python tools/ablation.py [part ...]

A line for each part: the case that needs it, a figure of that case with the part and without, and
without over with. A figure is an error, or a time, so that less is better; ``least`` is what it is
known to, and counts where the figure is less. A part earns its place where its line says at least
1.5. The exit status is 1 when one does not: it is to be removed. Times are the best of some runs.

The parts are switched off by their names in ``warp_contact/data/switches.py``, or by a constant
that the package has anyway; none is an option of a simulation. What cannot be left out is not in
the table: the broad and the narrow phase, the impulses, and eq. (1), which only says where the
search has to look.
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from measure.run import command_line, one_of
from parts.table import PARTS, Part

from warp_contact import SimulationError

WORTH = 1.5  # without over with: a part below it is not worth its lines
WIDTHS = 34, 33, 41, 9, 9, 9  # of the columns [characters]
COLUMNS = "part", "case", "figure", "with", "without", "ratio"


@dataclass(frozen=True)
class Line:
    """One line of the table."""

    part: Part
    kept: float
    off: float

    @property
    def ratio(self) -> float:
        """Without over with; a run that ends early or is not finite is infinitely worse."""
        if not math.isfinite(self.off):
            return math.inf
        return max(self.off, self.part.least) / max(self.kept, self.part.least)

    @property
    def worth(self) -> bool:
        """Whether the part earns its place."""
        return self.ratio >= WORTH

    def __str__(self):
        """Its columns."""
        numbers = (f"{x:.3g}" for x in (self.kept, self.off, self.ratio))
        cells = self.part.name, name(self.part.case), self.part.figure, *numbers
        line = "  ".join(c.ljust(w) for c, w in zip(cells, WIDTHS, strict=True))
        return line + ("" if self.worth else "WORSENS NOTHING")


def main() -> int:
    """Print the table as it comes."""
    parser = command_line(__doc__)
    parser.add_argument("parts", nargs="*", type=one_of(PARTS), metavar="part", help="or all")
    args = parser.parse_args()
    print("  ".join(c.ljust(w) for c, w in zip(COLUMNS, WIDTHS, strict=True)).rstrip())
    useless = []
    for key in args.parts or PARTS:
        line = compare(PARTS[key])
        print(str(line).rstrip(), flush=True)
        if not line.worth:
            useless.append(line.part.name)
    if useless:
        print(f"\nTo be removed: {', '.join(useless)}.")
    return 1 if useless else 0


def compare(part: Part) -> Line:
    """Run the case of a part with and without it."""
    kept = figures(part.case)[part.figure]
    try:
        with part.off():
            off = part.case()[part.figure]
    except SimulationError:
        off = math.inf
    return Line(part, kept, off)


@cache
def figures(case: Callable) -> dict[str, float]:
    """Those of a case with every part."""
    return case()


def name(case: Callable) -> str:
    """Of a case in the table."""
    return case.__doc__.splitlines()[0].rstrip(".")


if __name__ == "__main__":
    sys.exit(main())
