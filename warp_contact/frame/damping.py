"""How many stages the damping takes, and how much of their result counts."""

import math

RATE_MARGIN = 1.1  # on the damping rate, which is estimated and grows within a frame
USED_RANGE = 0.95  # part of the stable range that is used: at its end the stages do not damp
SHARE = 0.5, 7.0 / 9.0  # least and largest: a mode changes sign at a sixth of its speed at most


def stages_for(rate: float, dt: float) -> int:
    """Return the stages that ``damp`` needs for lambda_max ``rate`` [1/s] and step ``dt`` [s]."""
    z = RATE_MARGIN * rate * dt
    if z <= reach(1, SHARE[1]):
        return 1 if z > 0.0 else 0
    return max(2, math.ceil(0.5 * (math.sqrt(1.0 + 4.0 * z / (USED_RANGE * SHARE[1])) - 1.0)))


def share_for(rate: float, dt: float) -> float:
    """Return the smallest share that is stable then: it reverses fast modes the least."""
    stages = stages_for(rate, dt)
    needed = RATE_MARGIN * rate * dt / reach(stages, 1.0) if stages > 1 else 0.0
    return max(SHARE[0], needed)


def reach(stages: int, share: float) -> float:
    """Largest dt lambda_max of ``stages`` whose result counts by ``share``.

    One stage has p = 1 - z for any share: above 0 for z up to 1.
    """
    return float(stages) if stages < 2 else USED_RANGE * share * (stages * stages + stages)


def longest_step(stages: int, share: float) -> float:
    """Longest stable step times the frequency of a mode, whichever way it is damped.

    (h w)^2 < 2 (1 + p) with the least p of motion/motion.py, as P_s >= -1/2 within ``USED_RANGE``,
    or with p = 0 where that is less.
    """
    return 2.0 if stages == 0 else math.sqrt(2.0 if stages == 1 else min(2.0, 4.0 - 3.0 * share))
