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
from trials.parts import Case, Found, Quantity

from warp_contact import SimulationError
from warp_contact.data.switches import without
from warp_contact.frame import step_bounds, stepper
from warp_contact.kernels.impulse import constraint, tangent
from warp_contact.kernels.narrow_phase import edge_contact, edges, vertex_contact
from warp_contact.step import search

WORTH = 1.5  # without over with: a part below it is not worth its lines
WIDTHS = {"part": 34, "case": 33, "figure": 41, "with": 9, "without": 9, "ratio": 9}
TABLE = Table(**WIDTHS, said=0)


class Part(NamedTuple):
    """What is switched off, and who misses it."""

    name: str
    off: Callable  # a context in which it is off
    case: Case
    figure: Quantity  # of that case


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


_untwisted = switch("closure torque")
_planes = switch("old planes")
_kept = switch("broad phase kept")
_wide = kernel(constraint, "WIDE", math.inf)
_torque = kernel(constraint, "TURN", -1.0)
_counted = kernel(constraint, "COUNTED", 0.0)
_ramp = kernel(tangent, "UPRIGHT", 2.0, constraint)
_entry = kernel(vertex_contact, "ASTRAY", 0.0)
_deep_end = kernel(edge_contact, "ASIDE", 0.0, edges)
_bound = number(search, "SEARCH_BOUND", math.inf)
_deep = number(step_bounds, "LINGERING", step_bounds.TRAVEL)
_thin = number(step_bounds, "REACH", math.inf)
_repeats = number(step_bounds, "UNSTABLE", math.inf)
_within = number(stepper, "PART", 10**9)
_steady = number(step_bounds, "KEEP", 0.0)

_rows = {
    "edges": ("contacts of edges", switch("edges"), parts.CORNERS, parts.OVERLAP),
    "layers": ("depth behind the border", switch("layers"), parts.DEEP, parts.INSERTED),
    "search": ("search for the surface", switch("search"), parts.OVERLAPPING, parts.PLACE),
    "bound": ("bound of a move in the search", _bound, parts.DEEP, parts.INSERTED),
    "closure": ("closure", switch("closure"), parts.CORNERS, parts.OVERLAP),
    "look": ("second look, after the closure", switch("second look"), parts.FINE, parts.OVERLAP),
    "closure torque": ("torque of the closure", _untwisted, parts.CORNERS, parts.SPIN),
    "strays": ("vertices that left their triangles", switch("strays"), parts.FINE, parts.OVERLAP),
    "entry": ("back by the side it came in by", _entry, parts.RIM, parts.OVERLAP),
    "deep end": ("edges led out by their deep end", _deep_end, parts.ASIDE, parts.OVERLAP),
    "wide": ("no friction across wide gaps", _wide, parts.ROUGH_RIM, parts.SPIN),
    "torque": ("torque of friction across a gap", _torque, parts.OBLIQUE, parts.SPIN),
    "counted": ("weight of that torque in the sweeps", _counted, parts.CORNER, parts.GAINED),
    "ramp": ("ramps of facets", _ramp, parts.BENT, parts.GAINED),
    "planes": ("planes that the closure leaves out", _planes, parts.SEAM, parts.GAINED),
    "warm": ("warm start", switch("warm start"), parts.SHEET, parts.SWEEPS),
    "hold": ("persistent edges", switch("persistent edges"), parts.BALLS, parts.GAINED),
    "ahead": ("extrapolation of the sweeps", switch("extrapolation"), parts.DENSE, parts.GAINED),
    "kept": ("broad phase kept for many steps", _kept, parts.CROWD, parts.TIME),
    "deep": ("shorter steps while overlaps last", _deep, parts.INSIDE, parts.RISE),
    "thin": ("shorter steps for thin bodies", _thin, parts.THIN, parts.APPROACH),
    "repeats": ("frames repeated in shorter steps", _repeats, parts.PULLED, parts.FLATTENED),
    "within": ("looks within frames with flat tets", _within, parts.CRUSHED, parts.GAINED),
    "steady": ("steps that hardly grow again", _steady, parts.VIBRATING, parts.DRIFT),
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
        least = self.part.figure.least
        return max(self.off, least) / max(self.kept, least)

    @property
    def worth(self) -> bool:
        """Whether the part earns its place."""
        return self.ratio >= WORTH

    def __str__(self):
        """Its columns."""
        numbers = (f"{x:.3g}" for x in (self.kept, self.off, self.ratio))
        names = self.part.name, self.part.case.title, self.part.figure.name
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
    kept = with_every_part(part.case)[part.figure]
    try:
        with part.off():
            off = part.case.run()[part.figure]
    except SimulationError:
        off = math.inf
    return Line(part, kept, off)


@cache
def with_every_part(case: Case) -> Found:
    """The figures of a case; several parts may have the same."""
    return case.run()


if __name__ == "__main__":
    sys.exit(main())
