"""The parts of the default method, each with the case that needs it."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import warp as wp

from ablating import apart, impacts, loads, off
from ablating.off import without
from warp_contact.frame import step_bounds, stepper
from warp_contact.kernels.narrow_phase import edge_contact, edges, vertex_contact
from warp_contact.step import broad_phase, depth, impulse, step, surface


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


FINEST = 100.0 * surface.TOLERANCE  # % of an edge: an overlap that is left on purpose
GAIN = 1e-3  # of the energy: what a pile of roundings and closures may add
ROUNDED = 1e-6  # of the angular momentum: a walk of float32 over a thousand steps
FORCE = 1e-5  # of a force: float32, and a sample of some frames
PARTS = {
    "edges": Part(
        "contacts of edges",
        without(step, "edge_contacts", off.no_crossings),
        impacts.tilted,
        impacts.OVERLAP,
        FINEST,
    ),
    "layers": Part(
        "depth behind the border (stage 2)",
        without(depth, "hit_depths", off.border_only),
        loads.deep,
        loads.INSERTED,
        1e-3,
    ),
    "search": Part(
        "search for the surface (stage 4)",
        without(step, "move_surfaces", off.by_mass),
        loads.overlapping,
        loads.PLACE,
        1.0,
    ),
    "bound": Part(
        "bound of a move in stage 4",
        without(surface, "BOUND", math.inf),
        loads.deep,
        loads.INSERTED,
        1e-3,
    ),
    "closure": Part(
        "closure", without(surface, "close", off.nothing), impacts.tilted, impacts.OVERLAP, FINEST
    ),
    "looks": Part(
        "look after the closure",
        without(step, "move_surfaces", off.blind),
        impacts.fine,
        impacts.OVERLAP,
        FINEST,
    ),
    "vertices": Part(
        "of it, the look at vertices",
        without(step, "move_surfaces", off.unseen),
        impacts.fine,
        impacts.OVERLAP,
        FINEST,
    ),
    "couple": Part(
        "couple of the closure",
        without(surface, "close", off.without_couple),
        impacts.tilted,
        impacts.SPIN,
        ROUNDED,
    ),
    "strays": Part(
        "vertices that left or crossed their triangles",
        without(surface, "leftover", off.no_strays),
        impacts.fine,
        impacts.OVERLAP,
        FINEST,
    ),
    "entry": Part(
        "back by the side it came in by",
        off.constant(vertex_contact, "ASTRAY", 0.0),
        impacts.rim,
        impacts.OVERLAP,
        FINEST,
    ),
    "deep end": Part(
        "edges led out by their deep end",
        off.constant(edge_contact, "ASIDE", 0.0, edges),
        impacts.beside,
        impacts.OVERLAP,
        FINEST,
    ),
    "wide": Part(
        "no friction across wide gaps",
        without(impulse, "begin", off.rubbing),
        impacts.rough_rim,
        impacts.SPIN,
        ROUNDED,
    ),
    "friction": Part(
        "couple of friction across a gap",
        without(impulse, "begin", off.straight),
        impacts.oblique,
        impacts.SPIN,
        ROUNDED,
    ),
    "coupled": Part(
        "weight of that couple in the sweeps",
        without(impulse, "begin", off.uncoupled),
        impacts.corner,
        impacts.GAINED,
        GAIN,
    ),
    "ramp": Part(
        "ramps of facets",
        without(impulse, "begin", off.level),
        impacts.bent,
        impacts.GAINED,
        GAIN,
    ),
    "planes": Part(
        "planes that the closure leaves out",
        without(surface, "close", off.all_planes),
        impacts.seam,
        impacts.GAINED,
        GAIN,
    ),
    "warm": Part(
        "start from the last impulses",
        without(impulse, "recall", off.nothing),
        loads.sheet,
        loads.SWEEPS,
        1.0,
    ),
    "hold": Part(
        "contacts of edges that go on",
        without(step, "hold_edges", off.none_held),
        impacts.balls,
        impacts.GAINED,
        GAIN,
    ),
    "ahead": Part(
        "extrapolation of the sweeps",
        without(wp, "launch", off.plain),
        loads.dense,
        loads.GAINED,
        GAIN,
    ),
    "damping": Part(
        "damping before the forces",
        without(step, "predict", off.damp_last),
        loads.columns,
        loads.PRESSED,
        FORCE,
    ),
    "skins": Part(
        "candidates kept for many steps",
        without(broad_phase, "refresh", off.found_anew),
        apart.crowd,
        apart.TIME,
        0.0,
    ),
    "deep": Part(
        "shorter steps while there are overlaps from the start",
        without(step_bounds, "LINGERING", step_bounds.TRAVEL),
        loads.inserted,
        loads.RISE,
        GAIN,
    ),
    "thin": Part(
        "shorter steps for thin bodies",
        without(step_bounds, "REACH", math.inf),
        impacts.thin,
        impacts.APPROACH,
        0.01,
    ),
    "repeats": Part(
        "frames repeated in shorter steps", off.without_repeats, apart.pulled, apart.FLATTENED, 1.0
    ),
    "within": Part(
        "looks within frames with flat tets",
        without(stepper, "PART", 10**9),
        loads.crushed,
        loads.GAINED,
        GAIN,
    ),
    "steady": Part(
        "steps that hardly grow again",
        without(step_bounds, "KEEP", 0.0),
        apart.vibrating,
        apart.DRIFT,
        1e-3,
    ),
}
