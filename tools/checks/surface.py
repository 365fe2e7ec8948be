"""Stage 4 alone: where the contact surface of two overlapping blocks comes to lie.

Nothing moves but the surfaces, so each block is a layer of springs k = E / c, c the height of
its cells, and the surface belongs at the part a = k_other / (k_own + k_other) of the overlap from
where the block's own surface was.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

import warp_contact as wc
from checks.heights import facing, height
from checks.table import Row
from warp_contact.data.contacts import Capacity
from warp_contact.data.work import Work, allocate_work
from warp_contact.step import broad_phase, step, surface

EDGE = 0.1  # of a block [m]
YOUNG, DENSITY = 5e4, 1000.0  # of the lower block [Pa], [kg/m^3]
OVERLAP = 0.01  # [m]
DT = 1e-4  # [s]
CALLS = 200  # of stage 4, at most
ROOM = Capacity(contacts=4096, verts=8192, tets=65536, edges=8192, tris=65536, near=65536)
CELLS = (4, 4), (3, 4)
RATIOS = 1.0, 10.0
MATERIALS = {
    "corotated nu 0": (wc.Corotated, 0.0),
    "corotated nu 0.3": (wc.Corotated, 0.3),
    "neo-Hookean nu 0.3": (wc.NeoHookean, 0.3),
}
SEARCHES = "balanced", "literal"


def run(quick: bool) -> Iterator[Row]:
    """Every combination; the quick run takes one material."""
    materials = list(MATERIALS)[: 1 if quick else None]
    for search, name, cells, ratio in product(SEARCHES, materials, CELLS, RATIOS):
        case = f"surface {search} {cells[0]}:{cells[1]} 1:{ratio:g} {name}"
        yield from place(case, search, *MATERIALS[name], cells, ratio)


def build(model, poisson: float, cells: tuple[int, int], ratio: float) -> wc.Scene:
    """Two blocks that overlap by ``OVERLAP`` in z, the lower one's top at z = ``EDGE``."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    lower = wc.box(EDGE, cells[0])
    upper = wc.box(EDGE, cells[1], mirrored=cells[0] % 2 == 1)
    scene.add_body(lower, model(YOUNG, poisson, DENSITY), (0, 0, 0.5 * EDGE), label="lower")
    high = (0.0, 0.0, 1.5 * EDGE - OVERLAP)
    scene.add_body(upper, model(ratio * YOUNG, poisson, DENSITY), high, label="upper")
    return scene


def place(
    case: str, search: str, model, poisson: float, cells: tuple[int, int], ratio: float
) -> Iterator[Row]:
    """Rows of one combination."""
    sim = wc.Simulation(build(model, poisson, cells, ratio), wc.ContactSurface(search))
    work = allocate_work(sim.model, sim.state, ROOM)
    balanced = search == "balanced"
    slices = [slice(len(b.x)) if b.index == 0 else slice(-len(b.x), None) for b in sim.scene.bodies]
    (lower, under), (upper, above) = (
        (slices[b.index], facing(b.x, b.mesh.surface, 1.0 if b.index == 0 else -1.0))
        for b in sim.scene.bodies
    )
    calls = settle(sim, work)
    if work.contacts.needed.numpy().any():
        raise RuntimeError(f"capacities {work.contacts.needed.numpy()} needed")

    stiff = ratio * cells[1] / cells[0]  # k of the upper block over that of the lower one
    expected = EDGE - OVERLAP * stiff / (1.0 + stiff)
    x = sim.positions()
    for name, part, tris in (("lower", lower, under), ("upper", upper, above)):
        z = x[part][np.unique(tris), 2].astype(float)
        off = 100.0 * (z.mean() - expected) / OVERLAP
        most = (1.0 if cells[0] == cells[1] else 5.0) if balanced else None
        least = -most if most else None
        yield Row(case, f"surface of the {name} block [% of overlap]", off, most, least)
    yield Row(
        case,
        "its scatter, standard deviation [% of overlap]",
        100.0 * float(np.std(x[upper][np.unique(above), 2])) / OVERLAP,
    )
    gaps = gap(x[lower], under, x[upper], above)
    limit = 1.0 if balanced else None
    for figure, value in (
        ("largest gap", max(gaps.max(), 0.0)),
        ("largest overlap, vertical", max(-gaps.min(), 0.0)),
        ("deepest overlap, as measured", sim.measure().overlap),
    ):
        yield Row(case, f"{figure} [% of overlap]", 100.0 * value / OVERLAP, limit)
    yield Row(case, "calls of stage 4 until nothing is left", calls)
    speed = first_speed(build(model, poisson, cells, ratio), search)
    figure = "largest speed after one step [of overlap / dt]"
    yield Row(case, figure, speed / (OVERLAP / DT), 1e-6 if balanced else None)


def settle(sim: wc.Simulation, work: Work) -> int:
    """Let stage 4 move the surfaces until nothing is left; return how often it was called."""
    model, state = sim.model, sim.state
    work.dt.fill_(DT)
    work.bodies.rebuild()
    for call in range(CALLS):
        broad_phase.refresh(model, state.x, state.x, work)
        edges = sim.response.search == "balanced"
        step.contacts(model, state.x, state.x, work, fresh=False, edges=edges)
        surface.leftover(model, state.x, work)
        if not work.found.numpy()[0]:
            return call
        step.move_surfaces(model, state, work, sim.response, search=True)
    return CALLS


def gap(xl: np.ndarray, under: np.ndarray, xu: np.ndarray, above: np.ndarray) -> np.ndarray:
    """Vertical gap [m] at the vertices of both surfaces; those beside the other are left out."""
    top, bottom = xl[np.unique(under)], xu[np.unique(above)]
    at_top = height(top, xu, above) - top[:, 2]
    at_bottom = bottom[:, 2] - height(bottom, xl, under)
    gaps = np.concatenate([at_top, at_bottom])
    return gaps[np.isfinite(gaps)]


def first_speed(scene: wc.Scene, search: str) -> float:
    """Largest speed [m/s] after one full step from rest; the rest shapes carry no force."""
    sim = wc.Simulation(scene, wc.ContactSurface(search))
    work = allocate_work(sim.model, sim.state, ROOM)
    work.dt.fill_(DT)
    work.bodies.rebuild()
    step.step(sim.model, sim.state, work, sim.response, stages=0, search=True, unit=1.0)
    return float(np.linalg.norm(sim.velocities(), axis=1).max())
