"""The state that a step advances, and which part of it is awake."""

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
    """What moves: everything, unless bodies at rest may sleep.

    Attributes:
        bodies: 1 awake, 0 asleep, shape (n_body,)
        tets: the same for the tets, shape (n_tet,)
        inv_mass: 1 / m of vertices that take explicit steps, 0 for one that is fixed or asleep
            [1/kg], shape (n_vert,)
    """

    bodies: wp.array
    tets: wp.array
    inv_mass: wp.array
