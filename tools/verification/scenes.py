"""The scenes for two seconds with both responses; the bowl alone, with contact surfaces."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from measure.figure import Figure

import warp_contact as wc
from verification.heights import facing, height
from verification.setup import Ask
from warp_contact import SimulationError, scenes
from warp_contact.scenes import bowl as dish
from warp_contact.scenes import membrane_stack

FPS = 60
DURATION, QUICK = 2.0, 0.5  # [s]
TINY = 1e-6  # a volume ratio above which a tet is not inverted
CLEAR = 1e-3  # of an edge: an overlap that counts as resolved
DEEPEST = 1.0  # overlap that a contact surface may leave [% of an edge]
TIMES = 0.0, 0.1, 0.25, 0.5, 1.0, 1.5, 2.0  # of the energies that are shown [s]


@dataclass
class Run:
    """What one run showed at its start and after each frame, and why it stopped early.

    ``overlap`` is the deepest, in edges of the finer of its two bodies.
    """

    sim: wc.Simulation
    error: str = ""
    measured: list[wc.Measure] = field(default_factory=list)
    overlap: list[float] = field(default_factory=list)

    def look(self) -> None:
        """Measure a frame."""
        self.measured.append(self.sim.measure())
        self.overlap.append(in_edges(self.sim, self.measured[-1]))


def run(ask: Ask) -> Iterator[Figure]:
    """Every scene but the bowl."""
    frames = round((QUICK if ask.quick else DURATION) * FPS)
    for name in sorted(set(scenes.names()) - {"bowl"}):
        module = scenes.load(name)
        for response in (wc.ContactSurface(), wc.Penalty(**module.PENALTY)):
            yield from figures(name, play(module.build(), response, frames))


def bowl(ask: Ask) -> Iterator[Figure]:
    """The bowl of fruit in 64 steps a frame: long on a CPU."""
    settings, duration = ({"fraction": 0.2}, 0.25) if ask.quick else ({}, DURATION)
    scene = scenes.load("bowl").build(**settings)
    yield from figures("bowl", play(scene, wc.ContactSurface(), round(duration * FPS), 64))


def play(scene: wc.Scene, response, frames: int, substeps: int | None = None) -> Run:
    """Run a scene and keep what was measured."""
    sim = wc.Simulation(scene, response, fps=FPS, substeps=substeps)
    out = Run(sim)
    out.look()
    try:
        for _ in sim.frames(frames):
            out.look()
    except SimulationError as error:
        out.error = str(error)
    return out


def in_edges(sim: wc.Simulation, measured: wc.Measure) -> float:
    """The deepest overlap in edges of the finer of its two bodies."""
    edge = dict(zip(sim.model.labels, sim.model.body_edge.numpy().tolist(), strict=True))
    pair = measured.overlap_pair or ()
    return measured.overlap / min((edge[label] for label in pair if label in edge), default=1.0)


def figures(name: str, out: Run) -> Iterator[Figure]:
    """What counts for every scene, then what its picture shows."""
    strict = isinstance(out.sim.response, wc.ContactSurface)
    case = f"scenes {name} {'contact surface' if strict else 'penalty'}"
    last, ratios = out.sim.frame, [m.volume_ratio for m in out.measured]
    end = f"{out.sim.time:.2f} s"
    stopped = float(bool(out.error))
    yield Figure(case, "stopped by an error", stopped, most=0.0, note=out.error)
    least = TINY if strict else None
    yield Figure(case, f"smallest volume ratio at {end}", ratios[-1], least=least)
    yield Figure(case, "smallest volume ratio ever", min(ratios))
    lost = FALLEN[name](out.sim) if name in FALLEN else not_rising(out.sim, STACKS[name])
    most = 0.0 if strict else None
    yield Figure(case, "bodies fallen through", len(lost), most=most, note=", ".join(lost))
    clear = next((k for k, overlap in enumerate(out.overlap) if overlap <= CLEAR), None)
    if clear != 0:
        first = float("nan") if clear is None else clear
        yield Figure(case, "first frame without overlap", first, most=last if strict else None)
    since = min(last, 1) if clear is None else clear
    deepest = since + int(np.argmax(out.overlap[since:]))
    pair = " in ".join(out.measured[deepest].overlap_pair or ())
    note = f"in frame {deepest}: {pair}" if pair else ""
    most, value = DEEPEST if strict else None, 100.0 * out.overlap[deepest]
    yield Figure(case, "deepest overlap [% of an edge]", value, most=most, note=note)
    yield Figure(case, f"overlap at {end} [% of an edge]", 100.0 * out.overlap[-1])
    yield Figure(case, "kinetic energy, largest [J]", max(m.kinetic for m in out.measured))
    yield Figure(case, f"kinetic energy at {end} [J]", out.measured[-1].kinetic)
    for figure, value in SHOWN.get(name, lambda _: {})(out).items():
        yield Figure(case, figure, value)


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


def sink_depths(out: Run) -> dict[str, float]:
    """How far the bottoms of the cubes are below the membrane."""
    sheet, *cubes = out.sim.scene.bodies
    top, x = facing(sheet.x, sheet.mesh.surface, 1.0), out.sim.positions(sheet)
    figures = {}
    for cube in cubes:
        low = np.unique(facing(cube.x, cube.mesh.surface, -1.0))
        foot = out.sim.positions(cube)[low]
        sink = 1e3 * (height(foot, x, top) - foot[:, 2])
        figures[f"sink depth of {cube.label}, largest [mm]"] = float(np.nanmax(sink))
        figures[f"sink depth of {cube.label}, mean [mm]"] = float(np.nanmean(sink))
    return figures


def stack_figures(out: Run) -> dict[str, float]:
    """Height of the stack, and its energies over time."""
    high = out.sim.positions(out.sim.scene.bodies[-1]).mean(axis=0)[2]
    high += 0.5 * membrane_stack.THICKNESS
    whole = membrane_stack.COUNT * membrane_stack.THICKNESS
    figures = {"height of the stack [% of its rest height]": 100.0 * float(high) / whole}
    part = 100.0 / out.measured[0].gravitational
    for t, k in ((t, round(t * FPS)) for t in TIMES):
        if k < len(out.measured):
            now = out.measured[k]
            figures[f"kinetic energy at {t:g} s [% of first]"] = part * now.kinetic
            figures[f"potential energy at {t:g} s [% of first]"] = part * (
                now.gravitational + now.elastic
            )
    return figures


SHOWN = {"cubes_on_membrane": sink_depths, "membrane_stack": stack_figures}
