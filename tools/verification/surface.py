"""Stage 4 alone: where the contact surface of two overlapping blocks comes to lie.

Nothing moves but the surfaces, so each block is a layer of springs k = E / c, c the height of
its cells, and the surface belongs at the part a = k_other / (k_own + k_other) of the overlap from
where the block's own surface was.
"""

from itertools import product

import numpy as np
from measure.figure import Figures, zero

import warp_contact as wc
from verification.setup import facing, height
from warp_contact.data.overflow import Capacity
from warp_contact.data.work import allocate_work
from warp_contact.step import broad_phase, residual, search, surface
from warp_contact.step.detection import detect, detect_vertices

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


def run(quick: bool) -> Figures:
    """Every combination, whatever the response; the quick run takes one material."""
    materials = list(MATERIALS)[: 1 if quick else None]
    for way, name, cells, ratio in product(SEARCHES, materials, CELLS, RATIOS):
        case = f"surface {way} {cells[0]}:{cells[1]} 1:{ratio:g} {name}"
        yield from place(case, way, *MATERIALS[name], cells, ratio)


def found(way: str, law, poisson: float, cells, ratio: float) -> wc.Simulation:
    """Two blocks that overlapped at z = ``EDGE``, the lower one's top, after stage 4."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    upper = wc.box(EDGE, cells[1], mirrored=cells[0] % 2 == 1)
    scene.add_body(wc.box(EDGE, cells[0]), law(YOUNG, poisson, DENSITY), (0, 0, 0.5 * EDGE))
    scene.add_body(upper, law(ratio * YOUNG, poisson, DENSITY), (0.0, 0.0, 1.5 * EDGE - OVERLAP))
    sim = wc.Simulation(scene, wc.ContactSurface(way))
    model, state, tries = sim.model, sim.state, sim.response.iterations
    work = allocate_work(model, state, ROOM)
    work.dt.fill_(DT)
    for _ in range(CALLS):
        broad_phase.refresh(model, state.x, state.x, work)
        (detect if way == "balanced" else detect_vertices)(model, state.x, state.x, work)
        residual.find_gaps(model, state.x, work)
        if not work.surface.any_open.numpy()[0]:
            break
        if way == "balanced":
            surface.close_gaps(model, state, work, tries)
        else:
            search.bisect(model, state.x, work, tries)
    return sim


def place(case: str, way: str, law, poisson: float, cells, ratio) -> Figures:
    """Figures of one combination; those of the literal search are shown only."""
    sim, wanted = found(way, law, poisson, cells, ratio), way == "balanced"
    stiff = ratio * cells[1] / cells[0]  # k of the upper block over that of the lower one
    expected = EDGE - OVERLAP * stiff / (1.0 + stiff)
    most = ((1.0 if cells[0] == cells[1] else 5.0),) if wanted else ()
    x = [sim.positions(body) for body in sim.scene.bodies]
    tris = [facing(b.x, b.mesh.surface, (1.0, -1.0)[b.index]) for b in sim.scene.bodies]
    for name, at, own in zip(("lower", "upper"), x, tris, strict=True):
        off = 100.0 * (at[np.unique(own), 2].astype(float).mean() - expected) / OVERLAP
        yield zero(case, f"surface of the {name} block [% of overlap]", off, most)
    # At the vertices of both surfaces; nan beside the other one.
    top, bottom = (at[np.unique(own)] for at, own in zip(x, tris, strict=True))
    above = height(top, x[1], tris[1]) - top[:, 2]
    gaps = np.append(above, bottom[:, 2] - height(bottom, x[0], tris[0]))
    for figure, value in (
        ("largest gap", max(np.nanmax(gaps), 0.0)),
        ("largest overlap, vertical", max(-np.nanmin(gaps), 0.0)),
        ("deepest overlap, as measured", sim.measure().overlap),
    ):
        part = 100.0 * value / OVERLAP
        yield zero(case, f"{figure} [% of overlap]", part, (1.0,) if wanted else ())
