"""Two bars as chains of tets in exact contact: what the mesh makes of an impact.

    m (v' - v) = -h K u + j,  j = max(0, -(v_n + g / h)) / (1 / m1 + 1 / m2),  u' = u + h v'

Tets, lumped masses and steps are the simulator's, the elasticity is linear, and the vertices of
one end meet those of the other one by one. The impulse j is the least that leaves no overlap at the
end of the step: explicit dynamics with the contact condition of the next instant (Carpenter,
Taylor and Katona 1991). It needs no search, no weights, no closure and no single precision, so
that what differs from the simulator is due to these and what does not is due to the mesh.
"""

from collections.abc import Sequence

import numpy as np

import warp_contact as wc
from verification.setup import gradients, on_face
from warp_contact.scene.scene import Body


def collide(scene: wc.Scene, frame: float, steps: Sequence[int]) -> tuple[np.ndarray, ...]:
    """Run two bars along z, the lower first, without gravity, in so many steps of each frame [s].

    Returns the impulses between the bars in each frame [N s], the energy after it, of that at the
    start, the masses of the vertices [kg] and their velocities at the end [m/s].

    Raises:
        ValueError: the vertices at the ends do not face each other
    """
    lower, upper = scene.bodies
    below, above, start = ends(lower, upper)
    mass = np.concatenate([masses(lower), masses(upper)])
    reduced = 1.0 / (1.0 / mass[below] + 1.0 / mass[above])
    grad = np.concatenate([gradients(b.x, b.mesh.tets) for b in scene.bodies])
    stiff = np.concatenate([b.material.youngs_modulus * b.mesh.volumes for b in scene.bodies])
    tets = np.concatenate([lower.mesh.tets, upper.mesh.tets + len(lower.x)])
    at = (3 * tets[:, :, None] + np.arange(3)).ravel()  # where a tet's forces are among all
    v = np.concatenate([lower.v, upper.v])
    u = np.zeros_like(v)

    def pull() -> np.ndarray:
        """K u [N], shape (n_vert, 3): that of the energy V E eps : eps / 2, eps = sym(grad u)."""
        strain = np.einsum("tci,tcj->tij", u[tets], grad)
        strain = 0.5 * (strain + strain.swapaxes(1, 2)) * stiff[:, None, None]
        return np.bincount(at, (grad @ strain).ravel(), u.size).reshape(u.shape)

    def energy() -> float:
        return 0.5 * float(mass @ (v**2).sum(axis=1) + (u * pull()).sum())

    first, rows = energy(), []
    for n in steps:
        h, impulse = frame / n, 0.0
        for _ in range(n):
            v -= h * pull() / mass[:, None]
            gap = start + u[above, 2] - u[below, 2]
            j = np.maximum(0.0, v[below, 2] - v[above, 2] - gap / h) * reduced
            v[below, 2] -= j / mass[below]
            v[above, 2] += j / mass[above]
            u += h * v
            impulse += j.sum()
        rows.append((impulse, energy() / first))
    return *np.array(rows).T, mass, v


def ends(lower: Body, upper: Body) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices at the ends that meet, those of the upper bar counted on, and their gaps [m]."""
    below = np.flatnonzero(on_face(lower.mesh, 2, 1))
    above = np.flatnonzero(on_face(upper.mesh, 2, -1))
    if len(below) != len(above) or not np.allclose(lower.x[below, :2], upper.x[above, :2]):
        raise ValueError("the vertices at the ends of the bars do not face each other")
    return below, above + len(lower.x), upper.x[above, 2] - lower.x[below, 2]


def masses(body: Body) -> np.ndarray:
    """A quarter of each tet at each of its corners [kg], shape (n_vert,)."""
    quarter = 0.25 * body.material.density * body.mesh.volumes
    return np.bincount(body.mesh.tets.ravel(), np.repeat(quarter, 4), len(body.x))
