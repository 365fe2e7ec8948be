"""What the next frame takes over from the last one, beside the arrays on the device."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class LastFrame:
    """Numbers of the last frame, one for each world where they are arrays.

    Attributes:
        n: steps, 0 before the first frame, shape (n_world,)
        dt: their length [s], 0 before the first; the velocities of symplectic Euler are those of
            half of it before the positions, shape (n_world,)
        overlapping: 1 where there may be overlaps that no step created, 0 where there are none,
            -1 where it is to be found, shape (n_world,)
        rates: largest elastic frequency and damping rate at its end [1/s], None if to be found,
            shape (2, n_world)
    """

    n: np.ndarray
    dt: np.ndarray
    overlapping: np.ndarray
    rates: np.ndarray | None = None

    def values(self) -> dict[str, np.ndarray]:
        """What a checkpoint needs; what is to be found is left out."""
        return {k: np.array(value) for k, value in vars(self).items() if value is not None}


def none_yet(n_world: int) -> LastFrame:
    """Before the first frame."""
    return LastFrame(np.zeros(n_world, dtype=int), np.zeros(n_world), np.full(n_world, -1))


def last_frame_of(values: dict[str, np.ndarray]) -> LastFrame:
    """The instance that gave these ``values``."""
    return LastFrame(values["n"], values["dt"], values["overlapping"], values.get("rates"))
