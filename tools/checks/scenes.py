"""The scenes for two seconds with both responses, side by side; the bowl has its own case."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

import warp_contact as wc
from checks.heights import facing, height
from checks.table import Row
from warp_contact import scenes
from warp_contact.errors import SimulationError
from warp_contact.scenes import bowl, membrane_stack

FPS = 60
DURATION, QUICK = 2.0, 0.5  # [s]
TINY = 1e-6  # a volume ratio above which a tet is not inverted
CLEAR = 1e-3  # of an edge: an overlap that counts as resolved
ROWS = 0.0, 0.1, 0.25, 0.5, 1.0, 1.5, 2.0  # of the energies [s]


@dataclass
class Run:
    """What one run showed; shapes (frames + 1,), the start included.

    Attributes:
        error: why it stopped early
        clear: first frame without overlap, None if there was none
        deepest: overlap after any frame from then on, in edges of the finer body, with its frame
            and the labels of its bodies
    """

    sim: wc.Simulation
    error: str = ""
    clear: int | None = None
    deepest: tuple[float, int, tuple] = (0.0, 0, ())
    overlap: list[float] = field(default_factory=list)
    kinetic: list[float] = field(default_factory=list)
    gravitational: list[float] = field(default_factory=list)
    elastic: list[float] = field(default_factory=list)
    volume_ratio: list[float] = field(default_factory=list)


def run(quick: bool) -> Iterator[Row]:
    """Every scene but the bowl."""
    duration = QUICK if quick else DURATION
    for name in sorted(set(scenes.names()) - {"bowl"}):
        module = scenes.load(name)
        for response in (wc.ContactSurface(), wc.Penalty(**module.PENALTY)):
            result = play(module.build(), response, round(duration * FPS))
            yield from rows(name, result, isinstance(response, wc.ContactSurface))


def play(scene: wc.Scene, response, frames: int, substeps: int | None = None) -> Run:
    """Run a scene and keep what was measured."""
    sim = wc.Simulation(scene, response, fps=FPS, substeps=substeps)
    out = Run(sim)
    note(out, sim)
    try:
        for _ in sim.frames(frames):
            note(out, sim)
    except SimulationError as error:
        out.error = str(error)
    return out


def note(out: Run, sim: wc.Simulation) -> None:
    """Measure a frame."""
    measured = sim.measure()
    overlap = in_edges(sim, measured)
    out.overlap.append(overlap)
    out.kinetic.append(measured.kinetic)
    out.gravitational.append(measured.gravitational)
    out.elastic.append(measured.elastic)
    out.volume_ratio.append(measured.volume_ratio)
    if out.clear is None and overlap <= CLEAR:
        out.clear = sim.frame
    if out.clear is not None and overlap > out.deepest[0]:
        out.deepest = overlap, sim.frame, measured.overlap_pair


def in_edges(sim: wc.Simulation, measured: wc.Measure) -> float:
    """The deepest overlap in edges of the finer of its two bodies."""
    edge = dict(zip(sim.model.labels, sim.model.body_edge.numpy().tolist(), strict=True))
    pair = measured.overlap_pair or ()
    return measured.overlap / min((edge[label] for label in pair if label in edge), default=1.0)


def rows(name: str, out: Run, strict: bool) -> Iterator[Row]:
    """What counts for every scene, then what its picture shows."""
    case = f"scenes {name} {'contact surface' if strict else 'penalty'}"
    if out.error:
        print(f"{case}: {out.error}")
    sim = out.sim
    end = f"{sim.time:.2f} s"
    yield Row(case, "stopped by numbers that are not finite", float(bool(out.error)), 0.0)
    least = TINY if strict else None
    yield Row(case, f"smallest volume ratio at {end}", out.volume_ratio[-1], least=least)
    yield Row(case, "smallest volume ratio ever", min(out.volume_ratio))
    fallen = FALLEN[name](sim)
    if fallen:
        print(f"{case}: fallen through: {', '.join(fallen)}")
    yield Row(case, "bodies fallen through", len(fallen), 0.0 if strict else None)
    overlap, frame, pair = out.deepest
    if out.overlap[0] > CLEAR:
        clear = float("nan") if out.clear is None else out.clear
        yield Row(case, "first frame without overlap", clear, sim.frame if strict else None)
    if out.clear is None:
        overlap = max(out.overlap[1:], default=out.overlap[0])
    yield Row(case, "deepest overlap [% of an edge]", 100.0 * overlap, 1.0 if strict else None)
    if pair:
        yield Row(case, f"in frame: {' in '.join(pair)}", frame)
    yield Row(case, f"overlap at {end} [% of an edge]", 100.0 * out.overlap[-1])
    yield Row(case, "kinetic energy, largest [J]", max(out.kinetic))
    yield Row(case, f"kinetic energy at {end} [J]", out.kinetic[-1])
    for figure, value in SHOWN.get(name, lambda _: {})(out).items():
        yield Row(case, figure, value)


# Of each scene, the bodies whose centre is no longer above what carries them.


def centres(sim: wc.Simulation) -> dict[str, np.ndarray]:
    """Mean position of the vertices of each body [m]."""
    return {body.label: sim.positions(body).mean(axis=0) for body in sim.scene.bodies}


def not_rising(*stacks: tuple[str, ...]) -> Callable[[wc.Simulation], list[str]]:
    """The bodies of stacks, named from below, whose centre is not above that of the one before."""

    def fallen(sim: wc.Simulation) -> list[str]:
        at = centres(sim)
        planes = [(n, h) for n, h in sim.scene.planes if n[2] > 0.5]
        low = [label for label in at if any(at[label] @ n < h for n, h in planes)]
        pairs = (pair for stack in stacks for pair in pairwise(stack))
        return low + [upper for lower, upper in pairs if not at[upper][2] > at[lower][2]]

    return fallen


def through_membrane(sim: wc.Simulation) -> list[str]:
    """Cubes whose centre is below the membrane at its place."""
    sheet, *cubes = sim.scene.bodies
    top, x = facing(sheet.x, sheet.mesh.surface, 1.0), sim.positions(sheet)
    at = np.array([sim.positions(cube).mean(axis=0) for cube in cubes])
    z = height(at, x, top)
    return [cube.label for cube, ok in zip(cubes, at[:, 2] > z, strict=True) if not ok]


def out_of_dish(sim: wc.Simulation) -> list[str]:
    """Fruits whose centre is outside the sphere of the dish below its rim, or below the floor."""
    radius, depth, wall = (bowl.DISH[key] for key in ("radius", "depth", "thickness"))
    curve = 0.5 * (radius**2 + depth**2) / depth
    hub = np.array([0.0, 0.0, wall + curve])
    fallen = []
    for label, x in centres(sim).items():
        below_rim = np.hypot(*x[:2]) < radius and x[2] < depth
        if label != "dish" and (x[2] < 0.0 or (below_rim and np.linalg.norm(x - hub) > curve)):
            fallen.append(label)
    return fallen


FALLEN: dict[str, Callable[[wc.Simulation], list[str]]] = {
    "two_bodies": not_rising(("equal_lower", "equal_upper"), ("unequal_lower", "unequal_upper")),
    "sampling": not_rising(
        ("coarse_on_fine_slab", "coarse_on_fine_arch"),
        ("fine_on_coarse_slab", "fine_on_coarse_arch"),
    ),
    "cubes_on_membrane": through_membrane,
    "squeezed_sphere": not_rising(("lower_cube", "sphere", "upper_cube")),
    "membrane_stack": not_rising(tuple(f"membrane_{k}" for k in range(membrane_stack.COUNT))),
    "bowl": out_of_dish,
}


# What the paper's pictures show.


def sink_depths(out: Run) -> dict[str, float]:
    """How far the bottoms of the cubes are below the membrane."""
    sim = out.sim
    sheet, *cubes = sim.scene.bodies
    top, x = facing(sheet.x, sheet.mesh.surface, 1.0), sim.positions(sheet)
    figures = {}
    for cube in cubes:
        low = np.unique(facing(cube.x, cube.mesh.surface, -1.0))
        foot = sim.positions(cube)[low]
        sink = height(foot, x, top) - foot[:, 2]
        figures[f"sink depth of {cube.label}, largest [mm]"] = 1e3 * float(np.nanmax(sink))
        figures[f"sink depth of {cube.label}, mean [mm]"] = 1e3 * float(np.nanmean(sink))
    return figures


def stack_figures(out: Run) -> dict[str, float]:
    """Height of the stack, and its energies over time."""
    sim = out.sim
    top = sim.scene.bodies[-1]
    high = sim.positions(top).mean(axis=0)[2] + 0.5 * membrane_stack.THICKNESS
    whole = membrane_stack.COUNT * membrane_stack.THICKNESS
    figures = {"height of the stack [% of its rest height]": 100.0 * float(high) / whole}
    first = out.gravitational[0]
    for t in ROWS:
        k = round(t * FPS)
        if k < len(out.kinetic):
            figures[f"kinetic energy at {t:g} s [% of first]"] = 100.0 * out.kinetic[k] / first
            figures[f"potential energy at {t:g} s [% of first]"] = (
                100.0 * (out.gravitational[k] + out.elastic[k]) / first
            )
    return figures


SHOWN = {"cubes_on_membrane": sink_depths, "membrane_stack": stack_figures}
