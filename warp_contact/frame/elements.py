"""Some of the tets of a model, and the matrices of single ones."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import warp as wp

from warp_contact.data.model import Elements, Model


def some(model: Model, own: np.ndarray, number: np.ndarray) -> tuple[Elements, ...]:
    """The elements of tets that are ``own``, a mask, called by their ``number``; both (n_tet,)."""
    body, out = model.tet_body.numpy(), []
    for e in model.elements:
        tet, param = e.tet.numpy(), e.param.numpy()
        mine = tet[own[tet]]
        if len(mine):
            damped = any(model.materials[b].damping > 0.0 for b in np.unique(body[mine]))
            ids = wp.array(number[mine], dtype=int)
            row = wp.array(param[own[tet]], dtype=e.kernels.ROW)
            out.append(Elements(e.kernels, ids, row, damped))
    return tuple(out)


def apart(model: Model, of: np.ndarray) -> Model:
    """The tets ``of``, ids (n,), none of which share a vertex."""
    n, own, number = len(of), np.zeros(model.n_tet, dtype=bool), np.zeros(model.n_tet, dtype=int)
    own[of], number[of] = True, np.arange(n)
    tets = np.arange(4 * n, dtype=np.int32).reshape(-1, 4)
    return replace(
        model,
        n_tet=n,
        elements=some(model, own, number),
        tets=wp.array(tets, dtype=wp.vec4i),
        pose=wp.array(model.pose.numpy()[of], dtype=wp.mat33),
        volume=wp.array(model.volume.numpy()[of], dtype=float),
    )


def matrices(of_tets: Model, apply: Callable, corners: np.ndarray) -> np.ndarray:
    """What ``apply`` multiplies by with ``corners`` [m], (n_tet, 4, 3): shape (n_tet, 12, 12).

    Tets are ``apart``: twelve products give all columns.
    """
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
