"""Matrices of single tets, each with vertices of its own: twelve products give all columns."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import warp as wp

from warp_contact.data.model import Model


def apart(model: Model) -> Model:
    """The same tets, none of which share a vertex."""
    own = np.arange(4 * model.n_tet, dtype=np.int32).reshape(-1, 4)
    return replace(model, tets=wp.array(own, dtype=wp.vec4i))


def matrices(of_tets: Model, apply: Callable, corners: np.ndarray) -> np.ndarray:
    """What ``apply`` multiplies by with ``corners`` [m], (n_tet, 4, 3): shape (n_tet, 12, 12)."""
    x = wp.array(corners.reshape(-1, 3), dtype=wp.vec3)
    out = np.zeros((of_tets.n_tet, 12, 12))
    f = wp.zeros(4 * of_tets.n_tet, dtype=wp.vec3)
    for k in range(12):
        dx = np.zeros((of_tets.n_tet, 4, 3), dtype=np.float32)
        dx[:, k // 3, k % 3] = 1.0
        at = wp.array(dx.reshape(-1, 3), dtype=wp.vec3)
        f.zero_()
        apply(of_tets, x, at, f)
        out[:, :, k] = f.numpy().reshape(-1, 12)
    return out
