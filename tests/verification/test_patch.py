"""A2: the contact patch test."""

import numpy as np
import pytest
from verification import patch
from verification.setup import Pose


def test_the_start_is_the_exact_solution():
    pile = patch.pair((3, 2), False, Pose(True))
    sim = pile.simulate(patch.EXACT)
    # Positions of order 1 in float32 against a strain of 0.01.
    np.testing.assert_allclose(pile.pressures(sim, *sim.scene.bodies), 1e4, rtol=1e-3)
    ends = [pile.face(sim, 0, 1).mean(), pile.face(sim, 1, -1).mean()]
    np.testing.assert_allclose(ends, 0.495, atol=1e-6)


@pytest.mark.parametrize("cells", [(6, 4), (4, 6)])
def test_blocks_of_other_cells_carry_the_same_pressure(cells, hold):
    hold(patch.press(cells, slab=False, pose=Pose(True)), "excellent")


def slab(cells) -> list:
    """Force and rms error of the stress of a pair of slabs."""
    figures = patch.press(cells, slab=True, pose=Pose())
    return [f for f in figures if "force" in f.name or "rms" in f.name]


@pytest.mark.parametrize("cells", [(4, 4), (2, 3), (4, 6), (8, 12), (3, 16)])
def test_slabs_carry_the_same_pressure(cells, hold):
    hold(slab(cells), "excellent")
