"""Blocks that hit each other with corners and edges at random tilts: what no one chose.

The collisions of ``verification/collision.py``, with rotation, place, cells and stiffness drawn
anew for each number. Corners slide over facets that they bend, and pass each other tip on tip.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np
from verification import collision

from stable.case import Case
from stable.watch import Setting

DRAWS, QUICK = 180, 12
CELLS = (3, 3), (2, 5), (4, 6), (8, 8)
ASIDE = 0.03  # the largest shift along x and y [m]


def cases(quick: bool) -> Iterator[Case]:
    """So many draws; the number of each is its seed."""
    for k in range(QUICK if quick else DRAWS):
        yield Case(f"B2 blocks at random tilt {k}", partial(collide, k))


def collide(k: int) -> Setting:
    """Draw ``k``."""
    rng = np.random.default_rng(k)
    cells = CELLS[rng.integers(len(CELLS))]
    ratio = rng.choice(collision.RATIOS)
    angles = rng.uniform(0.0, 90.0, 3)
    shift = np.array([*rng.uniform(-ASIDE, ASIDE, 2), 0.0])
    scene = collision.build(*cells, ratio, "tilted shifted", angles=angles, shift=shift)
    return Setting(scene, collision.DURATION, collision.FPS, pairs=())
