"""The scenes for two seconds with both responses; the bowl alone, with contact surfaces."""

from itertools import pairwise

import numpy as np
from measure.figure import Figure, Figures

import warp_contact as wc
from verification.setup import facing, height
from warp_contact import SimulationError, scenes
from warp_contact.scenes import membrane_stack

FPS = 60
DURATION, QUICK = 2.0, 0.5  # [s]
TINY = 1e-6  # a volume ratio above which a tet is not inverted
CLEAR = 1e-3  # of an edge: an overlap that counts as resolved
DEEPEST = 1.0  # overlap that a contact surface may leave [% of an edge]
UPWARD = 0.2  # of the z of a normal of length 1: the inside of a bowl, but not its rim
CARRIED = {  # who carries whom, by their order in the scene; elsewhere the first carries all others
    "two_bodies": ((0, 1), (2, 3)),
    "sampling": ((0, 1), (2, 3)),
    "squeezed_sphere": ((0, 1), (1, 2)),
    "membrane_stack": tuple(pairwise(range(membrane_stack.COUNT))),
}
TIMES = 0.0, 0.1, 0.25, 0.5, 1.0, 1.5, 2.0  # of the energies that are shown [s]


def run(quick: bool) -> Figures:
    """Every scene but the bowl."""
    for name in sorted(set(scenes.names()) - {"bowl"}):
        module = scenes.load(name)
        for response in (wc.ContactSurface(), wc.Penalty(**module.PENALTY)):
            yield from play(name, module.build(), response, QUICK if quick else DURATION)


def bowl(quick: bool) -> Figures:
    """The bowl of fruit in 64 steps a frame: long on a CPU."""
    settings, seconds = ({"fraction": 0.2}, 0.25) if quick else ({}, DURATION)
    return play("bowl", scenes.load("bowl").build(**settings), wc.ContactSurface(), seconds, 64)


def play(name: str, scene: wc.Scene, response, seconds: float, substeps=None) -> Figures:
    """Run a scene: what counts for every one, then what its picture shows."""
    sim = wc.Simulation(scene, response, fps=FPS, substeps=substeps)
    measured, error = [sim.measure()], ""
    try:
        measured += (sim.measure() for _ in sim.frames(round(seconds * FPS)))
    except SimulationError as stop:
        error = str(stop)
    strict = isinstance(response, wc.ContactSurface)
    case, end = f"scenes {name} {'contact surface' if strict else 'penalty'}", f"{sim.time:.2f} s"
    yield Figure(case, "stopped by an error", float(bool(error)), most=0.0, note=error)
    ratios, least = [m.volume_ratio for m in measured], TINY if strict else None
    yield Figure(case, f"smallest volume ratio at {end}", ratios[-1], least=least)
    yield Figure(case, "smallest volume ratio ever", min(ratios))
    lost, most = fallen(name, sim), 0.0 if strict else None
    yield Figure(case, "bodies fallen through", len(lost), most=most, note=", ".join(lost))
    overlap = [in_edges(sim, m) for m in measured]
    clear = next((k for k, depth in enumerate(overlap) if depth <= CLEAR), None)
    if clear != 0:  # an overlap at the start
        first = float("nan") if clear is None else clear
        most = sim.frame if strict else None
        yield Figure(case, "first frame without overlap", first, most=most)
    since = min(sim.frame, 1) if clear is None else clear
    frame = since + int(np.argmax(overlap[since:]))
    pair, most = measured[frame].overlap_pair, DEEPEST if strict else None
    note = f"in frame {frame}: {' in '.join(pair)}" if pair else ""
    deepest = 100.0 * overlap[frame]
    yield Figure(case, "deepest overlap [% of an edge]", deepest, most=most, note=note)
    for figure, value in SHOWN.get(name, lambda *_: {})(sim, measured).items():
        yield Figure(case, figure, value)


def in_edges(sim: wc.Simulation, measured: wc.Measure) -> float:
    """The deepest overlap in edges of the finer of its two bodies."""
    edge = dict(zip(sim.model.labels, sim.model.body_edge.numpy().tolist(), strict=True))
    pair = measured.overlap_pair or ()
    return measured.overlap / min((edge[label] for label in pair if label in edge), default=1.0)


def fallen(name: str, sim: wc.Simulation) -> list[str]:
    """The bodies whose centre is below a floor, or below the surface that carries them."""
    bodies = sim.scene.bodies
    at = [sim.positions(body).mean(axis=0) for body in bodies]
    floors = [(n, h) for n, h in sim.scene.planes if n[2] > 0.5]
    lost = {k for k, x in enumerate(at) if any(x @ n < h for n, h in floors)}
    for k, upper in CARRIED.get(name) or ((0, k) for k in range(1, len(bodies))):
        top = facing(bodies[k].x, bodies[k].mesh.surface, 1.0, UPWARD)
        if at[upper][2] < height(at[upper][None], sim.positions(k), top)[0]:
            lost.add(upper)
    return [bodies[k].label for k in sorted(lost)]


def sink_depths(sim: wc.Simulation, measured: list[wc.Measure]) -> dict[str, float]:
    """How far the bottoms of the cubes are below the membrane."""
    sheet, *cubes = sim.scene.bodies
    top, figures = facing(sheet.x, sheet.mesh.surface, 1.0), {}
    for cube in cubes:
        foot = sim.positions(cube)[np.unique(facing(cube.x, cube.mesh.surface, -1.0))]
        sink = 1e3 * (height(foot, sim.positions(sheet), top) - foot[:, 2])
        figures[f"sink depth of {cube.label}, largest [mm]"] = float(np.nanmax(sink))
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


SHOWN = {"cubes_on_membrane": sink_depths, "membrane_stack": stack_figures}  # by the pictures
