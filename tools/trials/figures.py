"""The scenes of the paper as they are; blocks that no one chose.

``tilts`` are the collisions of ``verification/collision.py``, with rotation, place, cells and
stiffness drawn anew for each number. Corners slide over facets that they bend, and pass each other
tip on tip.
"""

from collections.abc import Iterator

import numpy as np
from verification import collision

from trials.setting import Case, Setting, case
from warp_contact import scenes

FPS = 60.0
PAIRED = {"pairs": ((0, 1), (2, 3))}  # bodies side by side

DRAWS = 180
CELLS = (3, 3), (2, 5), (4, 6), (8, 8)
ASIDE = 0.03  # the largest shift along x and y [m]


def cases() -> Iterator[Case]:
    """B4, B6, B7."""
    on_sheet = {"pairs": ((0, 1), (0, 2), (0, 3))}
    yield case("B4 three cubes on a membrane", paper, "cubes_on_membrane", 2.0, on_sheet)
    for mu in (0.3, 0.0):
        name = f"B6 stack of nine membranes, friction {mu:g}"
        yield case(name, paper, "membrane_stack", 0.5, friction=mu)
    fruit = {"fraction": 0.15}
    yield case("B7 bowl, 15% of the fruit", paper, "bowl", 0.5, {"pairs": ()}, **fruit)
    yield case("Fig. 1 arches on slabs", paper, "sampling", 2.0, PAIRED)
    yield case("Fig. 6 two pairs of blocks", paper, "two_bodies", 2.0, PAIRED | {"recovers": True})


def tilts() -> Iterator[Case]:
    """So many draws; the number of each is its seed."""
    for k in range(DRAWS):
        yield case(f"B2 blocks at random tilt {k}", collide, k)


def paper(name: str, seconds: float, watched: dict | None = None, **options) -> Setting:
    """A scene as it is; ``options`` of its ``build``."""
    return Setting(scenes.load(name).build(**options), seconds, FPS, **watched or {})


def collide(k: int) -> Setting:
    """Draw ``k``."""
    rng = np.random.default_rng(k)
    cells = CELLS[rng.integers(len(CELLS))]
    ratio = rng.choice(collision.RATIOS)
    angles = rng.uniform(0.0, 90.0, 3)
    shift = np.array([*rng.uniform(-ASIDE, ASIDE, 2), 0.0])
    scene = collision.build(*cells, ratio, "tilted shifted", angles=angles, shift=shift)
    return Setting(scene, collision.DURATION, collision.FPS, pairs=())
