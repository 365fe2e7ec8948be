"""The parts of the default method, each with the case that needs it."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from parts import apart, impacts, loads
from parts.off import constant, number, switch
from warp_contact.frame import step_bounds, stepper
from warp_contact.kernels.impulse import constraint, tangent
from warp_contact.kernels.lengths import CLOSURE_TOLERANCE
from warp_contact.kernels.narrow_phase import edge_contact, edges, vertex_contact
from warp_contact.step import search


@dataclass(frozen=True)
class Part:
    """What is switched off, and who misses it.

    Attributes:
        name: of the part
        off: a context in which it is off
        case: a function that returns figures by name
        figure: of that case
        least: what the figure is known to, from rounding or from chance
    """

    name: str
    off: Callable
    case: Callable[[], dict[str, float]]
    figure: str
    least: float


FINEST = 100.0 * float(CLOSURE_TOLERANCE)  # % of an edge: an overlap that is left on purpose
GAIN = 1e-3  # of the energy: what a pile of roundings and closures may add
ROUNDED = 1e-6  # of the angular momentum: a walk of float32 over a thousand steps


def _overlap(name: str, off: Callable, case: Callable) -> Part:
    return Part(name, off, case, impacts.OVERLAP, FINEST)


def _spin(name: str, off: Callable, case: Callable) -> Part:
    return Part(name, off, case, impacts.SPIN, ROUNDED)


def _gained(name: str, off: Callable, case: Callable) -> Part:
    return Part(name, off, case, impacts.GAINED, GAIN)


_inserted = loads.deep, loads.INSERTED, 1e-3
_without = {
    "wide": constant(constraint, "WIDE", math.inf),
    "torque": constant(constraint, "TURN", -1.0),
    "counted": constant(constraint, "COUNTED", 0.0),
    "ramp": constant(tangent, "UPRIGHT", 2.0, constraint),
    "entry": constant(vertex_contact, "ASTRAY", 0.0),
    "deep end": constant(edge_contact, "ASIDE", 0.0, edges),
    "bound": number(search, "SEARCH_BOUND", math.inf),
    "deep": number(step_bounds, "LINGERING", step_bounds.TRAVEL),
    "thin": number(step_bounds, "REACH", math.inf),
    "repeats": number(step_bounds, "UNSTABLE", math.inf),
    "within": number(stepper, "PART", 10**9),
    "steady": number(step_bounds, "KEEP", 0.0),
}
PARTS = {
    "edges": _overlap("contacts of edges", switch("edges"), impacts.tilted),
    "layers": Part("depth behind the border", switch("layers"), *_inserted),
    "search": Part("search for the surface", switch("search"), loads.overlapping, loads.PLACE, 1.0),
    "bound": Part("bound of a move in the search", _without["bound"], *_inserted),
    "closure": _overlap("closure", switch("closure"), impacts.tilted),
    "look": _overlap("second look, after the closure", switch("second look"), impacts.fine),
    "closure torque": _spin("torque of the closure", switch("closure torque"), impacts.tilted),
    "strays": _overlap("vertices that left their triangles", switch("strays"), impacts.fine),
    "entry": _overlap("back by the side it came in by", _without["entry"], impacts.rim),
    "deep end": _overlap("edges led out by their deep end", _without["deep end"], impacts.beside),
    "wide": _spin("no friction across wide gaps", _without["wide"], impacts.rough_rim),
    "torque": _spin("torque of friction across a gap", _without["torque"], impacts.oblique),
    "counted": _gained("weight of that torque in the sweeps", _without["counted"], impacts.corner),
    "ramp": _gained("ramps of facets", _without["ramp"], impacts.bent),
    "planes": _gained("planes that the closure leaves out", switch("old planes"), impacts.seam),
    "warm": Part("warm start", switch("warm start"), loads.sheet, loads.SWEEPS, 1.0),
    "hold": _gained("persistent edges", switch("persistent edges"), impacts.balls),
    "ahead": Part(
        "extrapolation of the sweeps", switch("extrapolation"), loads.dense, loads.GAINED, GAIN
    ),
    "kept": Part(
        "broad phase kept for many steps", switch("broad phase kept"), apart.crowd, apart.TIME, 0.0
    ),
    "deep": Part(
        "shorter steps while overlaps last", _without["deep"], loads.inserted, loads.RISE, GAIN
    ),
    "thin": Part(
        "shorter steps for thin bodies", _without["thin"], impacts.thin, impacts.APPROACH, 0.01
    ),
    "repeats": Part(
        "frames repeated in shorter steps",
        _without["repeats"],
        apart.pulled,
        apart.FLATTENED,
        1.0,
    ),
    "within": Part(
        "looks within frames with flat tets", _without["within"], loads.crushed, loads.GAINED, GAIN
    ),
    "steady": Part(
        "steps that hardly grow again", _without["steady"], apart.vibrating, apart.DRIFT, 1e-3
    ),
}
