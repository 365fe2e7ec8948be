"""A2: the contact patch test: two blocks pressed together carry the same pressure everywhere.

    p = E e / (L1 + L2) at every tet, whatever the meshes on both sides

Two blocks of height 1/2 and E = 1e6, Poisson ratio 0, pushed by e = 0.01 (Crisfield 2000; Taylor
and Papadopoulos 1991). They start in the exact solution and are given the time to leave it.
"""

import numpy as np
from measure.figure import Figures, relative, rms, zero

import warp_contact as wc
from verification.columns import Column, Pile, between
from verification.relax import rest
from verification.setup import ALIGNED, Ask, Pose

YOUNG, DENSITY = 1e6, 1000.0  # [Pa], [kg/m^3]
HEIGHT, PUSH = 0.5, 0.01  # of a block, of the upper end [m]
EXACT = YOUNG * PUSH / (2.0 * HEIGHT)  # [Pa]
THICK = 0.25  # of the slabs, one cell [m]
SLABS = (4, 4), (2, 3), (4, 6), (8, 12), (3, 16)  # cells across the lower and the upper slab
SOLIDS = (3, 2), (2, 3), (6, 4), (4, 6)  # across both directions
SETTLE = 12.0  # 1 / (slowest frequency)
# One-pass node-to-segment contact on 2:3 linear triangles leaves rms 4.6 % and max 7.1 % with the
# fine side as slave, 11.9 % and 17.7 % with the coarse one; two passes 1.4 to 2.6 % rms; mortar
# methods nothing.
RMS = 0.05, 0.015, 1e-4
MAX = 0.2, 0.03, 1e-4
FORCE = 0.02, 0.002, 1e-4


def run(ask: Ask) -> Figures:
    """Slabs and solid blocks; the quick run leaves out most turned ones."""
    for cells in SLABS:
        yield from press(ask, cells, slab=True, pose=ALIGNED)
    for cells in SOLIDS:
        for turned in (True,) if ask.quick else (False, True):
            yield from press(ask, cells, slab=False, pose=Pose(turned))
    if not ask.quick:
        yield from press(ask, (4, 6), slab=False, pose=ALIGNED, mesh="jittered")


def pair(cells: tuple[int, int], slab: bool, pose: Pose, mesh="structured", seed: int = 0) -> Pile:
    """Both blocks, in about cubic cells; slabs one cell thick."""
    section = 1.0, THICK if slab else 1.0
    blocks = []
    for k, n in enumerate(cells):
        count = n, 1 if slab else n, max(1, round(HEIGHT * n))
        blocks.append(Column(YOUNG, HEIGHT, DENSITY, count, section, mesh, seed + k))
    return Pile(blocks, -PUSH, clamped=True, pose=pose)


def press(ask: Ask, cells: tuple, slab: bool, pose: Pose, mesh="structured") -> Figures:
    """Stresses of all tets and the force between the blocks."""
    label = f"A2 {'slab' if slab else 'solid'} {cells[0]}:{cells[1]} {mesh} {pose}"
    pile = pair(cells, slab, pose, mesh, ask.seed)
    sim = pile.simulate(ask, EXACT)
    bodies = sim.scene.bodies

    def look() -> np.ndarray:
        return np.append(pile.pressures(sim, *bodies), between(sim))

    *stress, force = rest(sim, pile.columns[0].slowest, SETTLE, look).mean(axis=0)
    error = np.abs(np.array(stress) / EXACT - 1.0)
    force /= THICK if slab else 1.0
    yield relative(label, "contact force / section [Pa]", force, EXACT, FORCE)
    yield zero(label, "stress of the tets, rms error", rms(error), RMS)
    yield zero(label, "stress of the tets, largest error", error.max(), MAX)
    inner = np.concatenate([away_from_rim(body.mesh) for body in bodies])
    if inner.any():
        yield zero(label, "the same away from the rims of the faces", error[inner].max())
    yield zero(label, "deepest overlap [of the push]", sim.measure().overlap / PUSH)


def away_from_rim(mesh: wc.TetMesh) -> np.ndarray:
    """Mask of the tets without a vertex on a side; the long sides of a slab count as inside."""
    x = np.abs(mesh.vertices[mesh.tets][:, :, :2])
    half = np.abs(mesh.vertices[:, :2]).max(axis=0)
    on_side = (x > 0.999 * half).any(axis=1)
    return ~(on_side[:, 0] | (on_side[:, 1] & (half[1] > THICK)))
