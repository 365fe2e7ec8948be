"""Stresses of the tets of a body, in double precision.

Fixed corotated: P = 2 mu (F - R) + lam (J - 1) cof F with F = R S (Stomakhin et al. 2012). For a
Poisson ratio of 0 a bar stretched by s carries P = E (s - 1) exactly.
"""

import numpy as np

from warp_contact.scene.scene import Body


def first_piola(body: Body, x: np.ndarray) -> np.ndarray:
    """P [Pa] of each tet of a ``Corotated`` body at ``x`` [m], shape (m, 3, 3).

    ``x`` in the axes of the mesh: rotated back where the body was placed turned.
    """
    mu, lam = body.material.lame()
    tets = body.mesh.tets
    f = _edges(x[tets]) @ np.linalg.inv(_edges(body.mesh.vertices[tets]))
    u, _, vt = np.linalg.svd(f)
    flip = np.sign(np.linalg.det(u @ vt))
    u[:, :, 2] *= flip[:, None]
    j = np.linalg.det(f)[:, None, None]
    cof = j * np.swapaxes(np.linalg.inv(f), 1, 2)
    return 2.0 * mu * (f - u @ vt) + lam * (j - 1.0) * cof


def _edges(corners: np.ndarray) -> np.ndarray:
    return np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2).astype(float)
