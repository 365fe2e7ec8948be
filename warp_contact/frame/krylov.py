"""What the restarts of Lanczos begin with, and what their coefficients tell."""

import numpy as np

from warp_contact.data.model import Model
from warp_contact.frame.worlds import WorldIds

SECOND = 0.3  # part of the second mode in a restart, so that it can overtake
SEED = 20051125


def start_vectors(model: Model, worlds: WorldIds) -> np.ndarray:
    """Random vectors of mass norm 1 for each body, whatever other worlds there are: (n_vert, 3)."""
    u = np.empty((model.n_vert, 3))
    ends = np.cumsum(np.bincount(worlds.of_vert))
    for own in np.split(np.argsort(worlds.of_vert, kind="stable"), ends[:-1]):
        u[own] = np.random.default_rng(SEED).standard_normal((len(own), 3))
    u = np.where(model.inv_mass.numpy()[:, None] > 0.0, u, 0.0)
    body = model.vert_body.numpy()
    norm2 = np.bincount(body, model.mass.numpy() * (u * u).sum(axis=1), minlength=model.n_body)
    return u / np.sqrt(np.where(norm2 > 0.0, norm2, 1.0))[body, None]


def ritz_pairs(coef: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Largest |Ritz value| of each body, its residual norm, and how to restart in the basis."""
    a, b = coef[1::2].T, np.sqrt(coef[2::2]).T  # (n_body, depth)
    t = np.zeros((*a.shape, a.shape[1]))
    k = np.arange(a.shape[1])
    t[:, k, k] = a
    t[:, k[1:], k[:-1]] = b[:, :-1]
    value, vector = np.linalg.eigh(t)
    order = np.argsort(-np.abs(value), axis=1)
    body = np.arange(len(t))
    first, second = vector[body, :, order[:, 0]], vector[body, :, order[:, 1]]
    residual = b[:, -1] * np.abs(first[:, -1])
    return np.abs(value[body, order[:, 0]]), residual, first + SECOND * second
