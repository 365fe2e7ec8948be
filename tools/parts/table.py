"""The parts of the default method, each with the case that needs it.

A part is off by its name in ``warp_contact/data/switches.py``, or by another value of a constant.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from types import ModuleType
from typing import NamedTuple
from unittest import mock

import warp as wp

from parts import cases
from parts.cases import Case, Quantity
from warp_contact.data.switches import without
from warp_contact.frame import step_bounds, stepper
from warp_contact.kernels.impulse import constraint, tangent
from warp_contact.kernels.narrow_phase import edge_contact, edges, vertex_contact
from warp_contact.step import search


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
    "edges": ("contacts of edges", switch("edges"), cases.CORNERS, cases.OVERLAP),
    "layers": ("depth behind the border", switch("layers"), cases.DEEP, cases.INSERTED),
    "search": ("search for the surface", switch("search"), cases.OVERLAPPING, cases.PLACE),
    "bound": ("bound of a move in the search", _bound, cases.DEEP, cases.INSERTED),
    "closure": ("closure", switch("closure"), cases.CORNERS, cases.OVERLAP),
    "look": ("second look, after the closure", switch("second look"), cases.FINE, cases.OVERLAP),
    "closure torque": ("torque of the closure", _untwisted, cases.CORNERS, cases.SPIN),
    "strays": ("vertices that left their triangles", switch("strays"), cases.FINE, cases.OVERLAP),
    "entry": ("back by the side it came in by", _entry, cases.RIM, cases.OVERLAP),
    "deep end": ("edges led out by their deep end", _deep_end, cases.ASIDE, cases.OVERLAP),
    "wide": ("no friction across wide gaps", _wide, cases.ROUGH_RIM, cases.SPIN),
    "torque": ("torque of friction across a gap", _torque, cases.OBLIQUE, cases.SPIN),
    "counted": ("weight of that torque in the sweeps", _counted, cases.CORNER, cases.GAINED),
    "ramp": ("ramps of facets", _ramp, cases.BENT, cases.GAINED),
    "planes": ("planes that the closure leaves out", _planes, cases.SEAM, cases.GAINED),
    "warm": ("warm start", switch("warm start"), cases.SHEET, cases.SWEEPS),
    "hold": ("persistent edges", switch("persistent edges"), cases.BALLS, cases.GAINED),
    "ahead": ("extrapolation of the sweeps", switch("extrapolation"), cases.DENSE, cases.GAINED),
    "kept": ("broad phase kept for many steps", _kept, cases.CROWD, cases.TIME),
    "deep": ("shorter steps while overlaps last", _deep, cases.INSIDE, cases.RISE),
    "thin": ("shorter steps for thin bodies", _thin, cases.THIN, cases.APPROACH),
    "repeats": ("frames repeated in shorter steps", _repeats, cases.PULLED, cases.FLATTENED),
    "within": ("looks within frames with flat tets", _within, cases.CRUSHED, cases.GAINED),
    "steady": ("steps that hardly grow again", _steady, cases.VIBRATING, cases.DRIFT),
}
PARTS = {key: Part(*row) for key, row in _rows.items()}
