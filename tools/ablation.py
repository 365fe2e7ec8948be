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
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from types import ModuleType
from typing import NamedTuple
from unittest import mock

import warp as wp
from measure.report import Table
from measure.run import command_line, one_of
from trials import parts
from trials.parts import Case

from warp_contact import SimulationError
from warp_contact.data.switches import without
from warp_contact.frame import step_bounds, stepper
from warp_contact.kernels.impulse import constraint, tangent
from warp_contact.kernels.narrow_phase import edge_contact, edges, vertex_contact
from warp_contact.step import search

INF = math.inf
WORTH = 1.5  # without over with: a part below it is not worth its lines
WIDTHS = {"part": 34, "case": 33, "figure": 41, "with": 9, "without": 9, "ratio": 9}
TABLE = Table(**WIDTHS, said=0)


class Part(NamedTuple):
    """What is switched off, and who misses it."""

    name: str
    off: Callable  # a context in which it is off
    case: Case


@contextmanager
def compiled(owner: ModuleType, name: str, value: float, *users: ModuleType) -> Iterator[None]:
    """Kernels with another constant of ``owner``: its own, and those of ``users`` of it."""
    modules = [wp.get_module(module.__name__) for module in (owner, *users)]
    try:
        with mock.patch.object(owner, name, wp.constant(value)):
            for module in modules:
                module.mark_modified()
            yield
    finally:
        for module in modules:
            module.mark_modified()


def switch(name: str) -> Callable:
    """The context without a part that has a name."""
    return partial(without, name)


def kernel(owner: ModuleType, name: str, value: float, *users: ModuleType) -> Callable:
    """The context of another constant of kernels."""
    return partial(compiled, owner, name, value, *users)


def number(owner: ModuleType, name: str, value: float) -> Callable:
    """The context of another constant of the host."""
    return partial(mock.patch.object, owner, name, value)


_deep_end = kernel(edge_contact, "ASIDE", 0.0, edges)
_counted = kernel(constraint, "COUNTED", 0.0)
_deep = number(step_bounds, "LINGERING", step_bounds.TRAVEL)
_repeats = number(step_bounds, "UNSTABLE", INF)
_rows = {
    "edges": ("contacts of edges", switch("edges"), parts.CORNERS),
    "layers": ("depth behind the border", switch("layers"), parts.DEEP),
    "search": ("search for the surface", switch("search"), parts.OVERLAPPING),
    "bound": ("bound of a move in the search", number(search, "SEARCH_BOUND", INF), parts.DEEP),
    "closure": ("closure", switch("closure"), parts.CORNERS),
    "look": ("second look, after the closure", switch("second look"), parts.FINE),
    "closure torque": ("torque of the closure", switch("closure torque"), parts.TURNED),
    "search spin": ("spin that the search leaves", switch("search spin"), parts.PARTED),
    "strays": ("vertices that left their triangles", switch("strays"), parts.FINE),
    "entry": ("back by the side it came in by", kernel(vertex_contact, "ASTRAY", 0.0), parts.RIM),
    "deep end": ("edges led out by their deep end", _deep_end, parts.ASIDE),
    "wide": ("no friction across wide gaps", kernel(constraint, "WIDE", INF), parts.ROUGH_RIM),
    "torque": ("torque of friction across a gap", kernel(constraint, "TURN", -1.0), parts.OBLIQUE),
    "counted": ("weight of that torque in the sweeps", _counted, parts.CORNER),
    "ramp": ("ramps of facets", kernel(tangent, "UPRIGHT", 2.0, constraint), parts.BENT),
    "planes": ("planes that the closure leaves out", switch("old planes"), parts.PASSING),
    "warm": ("warm start", switch("warm start"), parts.SHEET),
    "hold": ("persistent edges", switch("persistent edges"), parts.BALLS),
    "ahead": ("extrapolation of the sweeps", switch("extrapolation"), parts.DENSE),
    "kept": ("broad phase kept for many steps", switch("broad phase kept"), parts.CROWD),
    "deep": ("shorter steps while overlaps last", _deep, parts.THICK_PLATE),
    "thin": ("shorter steps for thin bodies", number(step_bounds, "REACH", INF), parts.THIN),
    "repeats": ("frames repeated in shorter steps", _repeats, parts.PULLED),
    "within": ("looks within frames with flat tets", number(stepper, "PART", 10**9), parts.PRESSED),
    "steady": ("steps that hardly grow again", number(step_bounds, "KEEP", 0.0), parts.VIBRATING),
}
PARTS = {key: Part(*row) for key, row in _rows.items()}


class Line(NamedTuple):
    """One line of the table."""

    part: Part
    kept: float  # the figure with the part
    off: float  # and without

    @property
    def ratio(self) -> float:
        """Without over with; a run that ends early or is not finite is infinitely worse."""
        if not math.isfinite(self.off):
            return math.inf
        least = self.part.case.figure.least
        return max(self.off, least) / max(self.kept, least)

    @property
    def worth(self) -> bool:
        """Whether the part earns its place."""
        return self.ratio >= WORTH

    def __str__(self):
        """Its columns."""
        numbers = (f"{x:.3g}" for x in (self.kept, self.off, self.ratio))
        names = self.part.name, self.part.case.title, self.part.case.figure.name
        return TABLE.line(*names, *numbers, "" if self.worth else "WORSENS NOTHING")


def main() -> int:
    """Print the table as it comes."""
    parser = command_line(__doc__)
    parser.add_argument("parts", nargs="*", type=one_of(PARTS), metavar="part", help="or all")
    args = parser.parse_args()
    print(TABLE.line(*WIDTHS, ""))
    useless = []
    for key in args.parts or PARTS:
        line = compare(PARTS[key])
        print(line, flush=True)
        if not line.worth:
            useless.append(line.part.name)
    if useless:
        print(f"\nTo be removed: {', '.join(useless)}.")
    return 1 if useless else 0


def compare(part: Part) -> Line:
    """Run the case of a part with and without it."""
    kept = with_every_part(part.case)
    try:
        with part.off():
            off = part.case.run()
    except SimulationError:
        off = math.inf
    return Line(part, kept, off)


@cache
def with_every_part(case: Case) -> float:
    """The figure of a case; several parts may have the same."""
    return case.run()


if __name__ == "__main__":
    sys.exit(main())
