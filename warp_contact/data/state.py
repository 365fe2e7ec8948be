"""What a step advances, and what of it moves."""

from dataclasses import dataclass

import warp as wp


@dataclass
class State:
    """What a step advances.

    Attributes:
        x: positions [m], shape (n_vert,)
        v: velocities [m/s]; those of fixed vertices are prescribed, shape (n_vert,)
    """

    x: wp.array
    v: wp.array


@dataclass
class Awake:
    """What moves: all, unless bodies at rest may sleep.

    Attributes:
        bodies: 1, asleep 0, shape (n_body,)
        tets: the same of the tets, shape (n_tet,)
        inv_mass: 1 / m, 0 for a fixed vertex and asleep [1/kg], shape (n_vert,)
    """

    bodies: wp.array
    tets: wp.array
    inv_mass: wp.array
