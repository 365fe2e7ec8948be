"""A2: the contact patch test: two blocks pressed together carry the same pressure everywhere.

    p = E e / (L1 + L2) at every tet, whatever the meshes on both sides

Two blocks of height 1/2 and E = 1e6, Poisson ratio 0, pushed by e = 0.01 (Crisfield 2000; Taylor
and Papadopoulos 1991). They start in the exact solution and are given the time to leave it.
"""

import numpy as np
from measure.figure import Figures, relative, rms, zero

from verification.columns import Column, Pile, between
from verification.setup import ALIGNED, Pose, rest

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
# The resting gap, up to 1e-4 m of the push of 0.01 m, leaves the force open by some 0.3 %.
FORCE = 0.02, 0.003, 1e-4


def run(quick: bool) -> Figures:
    """Slabs and solid blocks; the quick run leaves out most turned ones."""
    for cells in SLABS:
        yield from press(cells, slab=True, pose=ALIGNED)
    for cells in SOLIDS:
        for turned in (True,) if quick else (False, True):
            yield from press(cells, slab=False, pose=Pose(turned))


def pair(cells: tuple[int, int], slab: bool, pose: Pose) -> Pile:
    """Both blocks, in about cubic cells; slabs one cell thick."""
    section = 1.0, THICK if slab else 1.0
    blocks = []
    for n in cells:
        count = n, 1 if slab else n, max(1, round(HEIGHT * n))
        blocks.append(Column(YOUNG, HEIGHT, DENSITY, count, section))
    return Pile(blocks, -PUSH, clamped=True, pose=pose)


def press(cells: tuple, slab: bool, pose: Pose) -> Figures:
    """Stresses of all tets and the force between the blocks."""
    label = f"A2 {'slab' if slab else 'solid'} {cells[0]}:{cells[1]} {pose.name}"
    pile = pair(cells, slab, pose)
    sim = pile.simulate(EXACT)

    def look() -> list[float]:
        return [*pile.pressures(sim, *sim.scene.bodies), *between(sim)]

    found = rest(sim, pile.columns[0].slowest, SETTLE, look)
    *stress, force = found.mean(axis=0)
    error, section = np.abs(np.array(stress) / EXACT - 1.0), THICK if slab else 1.0
    yield relative(label, "contact force / section [Pa]", force / section, EXACT, FORCE)
    yield zero(label, "stress of the tets, rms error", rms(error), RMS)
    yield zero(label, "stress of the tets, largest error", error.max(), MAX)
