"""The scenes for two seconds with both responses; the bowl alone, with contact surfaces."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from measure.figure import Figure

import warp_contact as wc
from verification.setup import Ask, facing, height
from warp_contact import SimulationError, scenes
from warp_contact.scenes import bowl as dish
from warp_contact.scenes import membrane_stack

FPS = 60
DURATION, QUICK = 2.0, 0.5  # [s]
TINY = 1e-6  # a volume ratio above which a tet is not inverted
CLEAR = 1e-3  # of an edge: an overlap that counts as resolved
DEEPEST = 1.0  # overlap that a contact surface may leave [% of an edge]
TIMES = 0.0, 0.1, 0.25, 0.5, 1.0, 1.5, 2.0  # of the energies that are shown [s]


def run(ask: Ask) -> Iterator[Figure]:
    """Every scene but the bowl."""
    frames = round((QUICK if ask.quick else DURATION) * FPS)
    for name in sorted(set(scenes.names()) - {"bowl"}):
        module = scenes.load(name)
        for response in (wc.ContactSurface(), wc.Penalty(**module.PENALTY)):
            yield from play(name, module.build(), response, frames)


def bowl(ask: Ask) -> Iterator[Figure]:
    """The bowl of fruit in 64 steps a frame: long on a CPU."""
    settings, duration = ({"fraction": 0.2}, 0.25) if ask.quick else ({}, DURATION)
    scene = scenes.load("bowl").build(**settings)
    return play("bowl", scene, wc.ContactSurface(), round(duration * FPS), 64)


def play(
    name: str, scene: wc.Scene, response, frames: int, substeps: int | None = None
) -> Iterator[Figure]:
    """Run a scene: what counts for every one, then what its picture shows."""
    sim = wc.Simulation(scene, response, fps=FPS, substeps=substeps)
    measured, error = [sim.measure()], ""
    try:
        measured += (sim.measure() for _ in sim.frames(frames))
    except SimulationError as stop:
        error = str(stop)
    strict = isinstance(response, wc.ContactSurface)
    case = f"scenes {name} {'contact surface' if strict else 'penalty'}"
    yield Figure(case, "stopped by an error", float(bool(error)), most=0.0, note=error)
    ratios, end = [m.volume_ratio for m in measured], f"{sim.time:.2f} s"
    least = TINY if strict else None
    yield Figure(case, f"smallest volume ratio at {end}", ratios[-1], least=least)
    yield Figure(case, "smallest volume ratio ever", min(ratios))
    lost = FALLEN[name](sim) if name in FALLEN else not_rising(sim, STACKS[name])
    most = 0.0 if strict else None
    yield Figure(case, "bodies fallen through", len(lost), most=most, note=", ".join(lost))
    yield from overlaps(case, sim, measured, strict)
    yield Figure(case, "kinetic energy, largest [J]", max(m.kinetic for m in measured))
    yield Figure(case, f"kinetic energy at {end} [J]", measured[-1].kinetic)
    for figure, value in SHOWN.get(name, lambda *_: {})(sim, measured).items():
        yield Figure(case, figure, value)


def overlaps(
    case: str, sim: wc.Simulation, measured: list[wc.Measure], strict: bool
) -> Iterator[Figure]:
    """When an overlap at the start is resolved; the deepest one from then on, and the last."""
    overlap = [in_edges(sim, m) for m in measured]
    clear = next((k for k, depth in enumerate(overlap) if depth <= CLEAR), None)
    if clear != 0:
        first = float("nan") if clear is None else clear
        most = sim.frame if strict else None
        yield Figure(case, "first frame without overlap", first, most=most)
    since = min(sim.frame, 1) if clear is None else clear
    frame = since + int(np.argmax(overlap[since:]))
    pair = " in ".join(measured[frame].overlap_pair or ())
    most, note = DEEPEST if strict else None, f"in frame {frame}: {pair}" if pair else ""
    name = "deepest overlap [% of an edge]"
    yield Figure(case, name, 100.0 * overlap[frame], most=most, note=note)
    yield Figure(case, f"overlap at {sim.time:.2f} s [% of an edge]", 100.0 * overlap[-1])


def in_edges(sim: wc.Simulation, measured: wc.Measure) -> float:
    """The deepest overlap in edges of the finer of its two bodies."""
    edge = dict(zip(sim.model.labels, sim.model.body_edge.numpy().tolist(), strict=True))
    pair = measured.overlap_pair or ()
    return measured.overlap / min((edge[label] for label in pair if label in edge), default=1.0)


# Of each scene, the bodies whose centre is no longer above what carries them.

STACKS = {  # named from below
    "two_bodies": (("equal_lower", "equal_upper"), ("unequal_lower", "unequal_upper")),
    "sampling": (
        ("coarse_on_fine_slab", "coarse_on_fine_arch"),
        ("fine_on_coarse_slab", "fine_on_coarse_arch"),
    ),
    "squeezed_sphere": (("lower_cube", "sphere", "upper_cube"),),
    "membrane_stack": (tuple(f"membrane_{k}" for k in range(membrane_stack.COUNT)),),
}


def centres(sim: wc.Simulation) -> dict[str, np.ndarray]:
    """Mean position of the vertices of each body [m]."""
    return {body.label: sim.positions(body).mean(axis=0) for body in sim.scene.bodies}


def not_rising(sim: wc.Simulation, stacks: tuple[tuple[str, ...], ...]) -> list[str]:
    """The bodies whose centre is below a floor, or not above that of the one before in a stack."""
    at = centres(sim)
    floors = [(n, h) for n, h in sim.scene.planes if n[2] > 0.5]
    low = [label for label in at if any(at[label] @ n < h for n, h in floors)]
    pairs = (pair for stack in stacks for pair in pairwise(stack))
    return low + [upper for lower, upper in pairs if not at[upper][2] > at[lower][2]]


def through_membrane(sim: wc.Simulation) -> list[str]:
    """Cubes whose centre is below the membrane at its place."""
    sheet, *cubes = sim.scene.bodies
    at = np.array([sim.positions(cube).mean(axis=0) for cube in cubes])
    z = height(at, sim.positions(sheet), facing(sheet.x, sheet.mesh.surface, 1.0))
    return [cube.label for cube, ok in zip(cubes, at[:, 2] > z, strict=True) if not ok]


def out_of_dish(sim: wc.Simulation) -> list[str]:
    """Fruits whose centre is outside the sphere of the dish below its rim, or below the floor."""
    radius, depth, wall = (dish.DISH[key] for key in ("radius", "depth", "thickness"))
    curve = 0.5 * (radius**2 + depth**2) / depth
    hub = np.array([0.0, 0.0, wall + curve])
    fallen = []
    for label, x in centres(sim).items():
        below_rim = np.hypot(*x[:2]) < radius and x[2] < depth
        if label != "dish" and (x[2] < 0.0 or (below_rim and np.linalg.norm(x - hub) > curve)):
            fallen.append(label)
    return fallen


FALLEN = {"cubes_on_membrane": through_membrane, "bowl": out_of_dish}


# What the paper's pictures show.


def sink_depths(sim: wc.Simulation, measured: list[wc.Measure]) -> dict[str, float]:
    """How far the bottoms of the cubes are below the membrane."""
    sheet, *cubes = sim.scene.bodies
    top, x = facing(sheet.x, sheet.mesh.surface, 1.0), sim.positions(sheet)
    figures = {}
    for cube in cubes:
        foot = sim.positions(cube)[np.unique(facing(cube.x, cube.mesh.surface, -1.0))]
        sink = 1e3 * (height(foot, x, top) - foot[:, 2])
        figures[f"sink depth of {cube.label}, largest [mm]"] = float(np.nanmax(sink))
        figures[f"sink depth of {cube.label}, mean [mm]"] = float(np.nanmean(sink))
    return figures


def stack_figures(sim: wc.Simulation, measured: list[wc.Measure]) -> dict[str, float]:
    """Height of the stack, and its energies over time."""
    high = sim.positions(sim.scene.bodies[-1]).mean(axis=0)[2] + 0.5 * membrane_stack.THICKNESS
    whole = membrane_stack.COUNT * membrane_stack.THICKNESS
    figures = {"height of the stack [% of its rest height]": 100.0 * float(high) / whole}
    part = 100.0 / measured[0].gravitational
    for t, now in ((t, measured[round(t * FPS)]) for t in TIMES if t <= sim.time):
        potential = now.gravitational + now.elastic
        figures[f"kinetic energy at {t:g} s [% of first]"] = part * now.kinetic
        figures[f"potential energy at {t:g} s [% of first]"] = part * potential
    return figures


SHOWN = {"cubes_on_membrane": sink_depths, "membrane_stack": stack_figures}
