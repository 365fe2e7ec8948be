"""What the next frame takes over from the last one, beside the arrays on the device."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class LastFrame:
    """Numbers of the last frame.

    Attributes:
        n: its steps, 0 before the first
        dt: their length [s], 0 before the first; the velocities of symplectic Euler are those of
            half of it before the positions
        rates: largest elastic frequency and damping rate at its end [1/s], None if to be found
        overlapping: whether there may be overlaps that no step created, None if to be found
    """

    n: int = 0
    dt: float = 0.0
    rates: tuple[float, float] | None = None
    overlapping: bool | None = None

    def values(self) -> dict[str, np.ndarray]:
        """What a checkpoint needs; what is to be found is left out."""
        return {k: np.array(value) for k, value in vars(self).items() if value is not None}


def last_frame_of(values: dict[str, np.ndarray]) -> LastFrame:
    """The instance that gave these ``values``."""
    return LastFrame(
        n=int(values["n"]),
        dt=float(values["dt"]),
        rates=tuple(map(float, values["rates"])) if "rates" in values else None,
        overlapping=bool(values["overlapping"]) if "overlapping" in values else None,
    )
