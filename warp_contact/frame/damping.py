"""The polynomial that stands for the exponential of the damping, see kernels/motion/damping.py.

p(z) = 1 - z phi(z) has to be near exp(-z) for z = h lambda from 0 to the ``reach`` of the step:
within ``NEAR`` of it while it is above ``FADED``, and no larger than that beyond. phi, with
phi(0) = 1, is fitted to that by weighted least squares; ``STAGES`` sqrt(reach) stages suffice, by
test.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from warp_contact.data.damping import MOST, Damping

RATE_MARGIN = 1.1  # on the damping rate, which is estimated and grows within a frame
NEAR, FADED = 0.05, 0.01
STAGES = 2.3
FEW = 0.04, 0.75  # reach of one stage, and of two
LADDER = 1.02  # between two values of the reach, so that few polynomials are fitted


def reach_for(rate: float, dt: float) -> float:
    """Largest step times eigenvalue [-] to serve, for a ``rate`` [1/s] and a step ``dt`` [s]."""
    z = RATE_MARGIN * rate * dt
    for least in FEW:
        if z <= least:
            return least
    return LADDER ** math.ceil(math.log(z) / math.log(LADDER) - 1e-9)


def stages_for(rate: float, dt: float) -> int:
    """Return how often a step ``dt`` [s] applies the damping, of which ``rate`` [1/s] is most."""
    reach = reach_for(rate, dt)
    return 1 if reach == FEW[0] else math.ceil(STAGES * math.sqrt(reach) - 1e-9)


def prepare(d: Damping | None, rate: float, dt: float) -> int:
    """Fill the polynomial of steps ``dt`` [s] in for a ``rate`` [1/s]; return their stages."""
    if d is None:
        return 0
    stages, reach = stages_for(rate, dt), reach_for(rate, dt)
    d.coef.assign(coefficients(reach, stages))
    d.reach.fill_(reach)
    return stages


@lru_cache(maxsize=256)
def coefficients(reach: float, stages: int) -> np.ndarray:
    """Chebyshev coefficients of phi on [0, ``reach``], shape (MOST,): ``stages``, then zeros."""
    coef = np.zeros(MOST)
    if stages > 1:
        n = 8 * stages + 40
        t = np.cos(np.pi * (np.arange(n) + 0.5) / n)
        z = 0.5 * reach * (1.0 - t)
        weight = 1.0 / _tolerance(z)
        basis = (weight * z)[:, None] * (chebvander(t, stages - 1)[:, 1:] - 1.0)
        wanted = -weight * (np.expm1(-z) + z)
        coef[1:stages] = np.linalg.lstsq(basis, wanted, rcond=None)[0]
    coef[0] = 1.0 - coef.sum()
    return coef.astype(np.float32)


def _tolerance(z: np.ndarray) -> np.ndarray:
    """How far p(z) may be from exp(-z)."""
    faded = -math.log(FADED)
    beyond = NEAR * FADED + (FADED - NEAR * FADED) * np.clip((z - faded) / 0.7, 0.0, 1.0)
    fast = np.where(z < faded, NEAR * np.exp(-z), beyond)
    return np.minimum(NEAR * z, fast)
