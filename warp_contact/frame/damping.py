"""The polynomial that stands for the exponential of the damping, see kernels/motion/damping.py.

p(z) = 1 - z phi(z) has to be near exp(-z) for z = h lambda from 0 to the ``reach`` of the step:
within ``NEAR`` of it while it is above ``FADED``, and no larger than that beyond. phi, with
phi(0) = 1, is fitted to that by weighted least squares; ``STAGES`` sqrt(reach) stages suffice, by
test.
"""

import math
from functools import lru_cache

import numpy as np
import warp as wp
from numpy.polynomial.chebyshev import chebvander

from warp_contact.data.damping import MOST, Damping
from warp_contact.step.damping import scale_contacts

RATE_MARGIN = 1.1  # on the damping rate, which is estimated and grows within a frame
NEAR, FADED = 0.05, 0.01
STAGES = 2.3
FEW = 0.04, 0.75  # reach of one stage, and of two
LADDER = 1.02  # between two values of the reach, so that few polynomials are fitted


def reach_for(rate, dt):
    """Largest step times eigenvalue [-] to serve, for a ``rate`` [1/s] and a step ``dt`` [s].

    Both may be arrays.
    """
    z = RATE_MARGIN * np.asarray(rate) * dt
    power = np.ceil(np.log(np.maximum(z, FEW[1])) / math.log(LADDER) - 1e-9)
    return np.where(z <= FEW[0], FEW[0], np.where(z <= FEW[1], FEW[1], LADDER**power))


def stages_for(rate, dt) -> int:
    """Return how often steps ``dt`` [s] apply the damping, of which ``rate`` [1/s] is most."""
    return _stages(float(np.max(reach_for(rate, dt))))


def prepare(
    d: Damping | None, rate: np.ndarray, dt: np.ndarray, of_vert: np.ndarray, last: np.ndarray
) -> int:
    """Fill the polynomials of worlds in, and return the stages of a step.

    Args:
        d: what to fill
        rate: largest damping rate of each world [1/s], shape (n_world,)
        dt: their steps [s], shape (n_world,)
        of_vert: number of the world of each vertex, shape (n_vert,)
        last: the steps before [s], 0 before the first, shape (n_world,)
    """
    if d is None:
        return 0
    if last.any() and (last != dt).any():
        by = np.where(last > 0.0, dt / np.where(last > 0.0, last, 1.0), 1.0)
        scale_contacts(d, wp.array(by[of_vert].astype(np.float32), dtype=float))
    reach, row = np.unique(np.atleast_1d(reach_for(rate, dt)), return_inverse=True)
    coef = np.stack([coefficients(float(r), _stages(float(r))) for r in reach])
    d.coef.assign(coef[row])
    d.reach.assign(reach[row].astype(np.float32))
    return stages_for(rate, dt)


def _stages(reach: float) -> int:
    return 1 if reach <= FEW[0] else math.ceil(STAGES * math.sqrt(reach) - 1e-9)


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
