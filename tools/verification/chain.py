"""Two bars as chains of tets in exact contact: what the mesh makes of an impact.

    m (v' - v) = -h K u + j,  j = max(0, -(v_n + g / h)) / (1 / m1 + 1 / m2),  u' = u + h v'

Tets, lumped masses and steps are the simulator's, the elasticity is linear, and the vertices of
one end meet those of the other one by one. The impulse j is the least that leaves no overlap at the
end of the step: explicit dynamics with the contact condition of the next instant (Carpenter,
Taylor and Katona 1991). It needs no search, no weights, no closure and no single precision, so
that what differs from the simulator is due to these and what does not is due to the mesh.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import warp_contact as wc
from warp_contact.scene.scene import Body


@dataclass
class Run:
    """What the bars did.

    Attributes:
        impulse: between the bars, of each frame [N s], shape (n,)
        energy: at the ends of the frames, of that at the start, shape (n,)
        mass: of the vertices of both bars [kg], shape (n_vert,)
        v: velocities at the end [m/s], shape (n_vert, 3)
    """

    impulse: np.ndarray
    energy: np.ndarray
    mass: np.ndarray
    v: np.ndarray


def collide(scene: wc.Scene, frame: float, steps: Sequence[int]) -> Run:
    """Run two bars along z, the lower first and Poisson ratio 0, without gravity.

    Args:
        scene: the bars
        frame: duration of a frame [s]
        steps: of each frame

    Raises:
        ValueError: the vertices at the ends do not face each other
    """
    lower, upper = scene.bodies
    below, above, start = facing(lower, upper)
    mass = np.concatenate([masses(lower), masses(upper)])
    reduced = 1.0 / (1.0 / mass[below] + 1.0 / mass[above])
    k = np.concatenate([stiffness(lower), stiffness(upper)])
    tets = np.concatenate([lower.mesh.tets, upper.mesh.tets + len(lower.x)])
    at = (3 * tets[:, :, None] + np.arange(3)).reshape(-1, 12)  # where a tet's u are among all
    v = np.concatenate([lower.v, upper.v])
    u = np.zeros_like(v)

    def pull() -> np.ndarray:
        """K u [N], shape (n_vert, 3)."""
        of_tets = np.einsum("tij,tj->ti", k, u.ravel()[at])
        return np.bincount(at.ravel(), of_tets.ravel(), u.size).reshape(u.shape)

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
    return Run(*np.array(rows).T, mass, v)


def facing(lower: Body, upper: Body) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices at the upper end of one bar and the lower of the other, and their gaps [m].

    Those of the upper bar count on from those of the lower one.
    """
    ends = []
    for body, side in ((lower, 1.0), (upper, -1.0)):
        z = side * body.x[:, 2]
        at = np.flatnonzero(z > z.max() - 1e-6 * np.ptp(z))
        ends.append(at[np.lexsort(body.x[at, :2].T)])
    a, b = lower.x[ends[0]], upper.x[ends[1]]
    if a.shape != b.shape or not np.allclose(a[:, :2], b[:, :2]):
        raise ValueError("the vertices at the ends of the bars do not face each other")
    return ends[0], ends[1] + len(lower.x), b[:, 2] - a[:, 2]


def masses(body: Body) -> np.ndarray:
    """A quarter of each tet at each of its corners [kg], shape (n_vert,)."""
    quarter = 0.25 * body.material.density * body.mesh.volumes
    return np.bincount(body.mesh.tets.ravel(), np.repeat(quarter, 4), len(body.x))


def stiffness(body: Body) -> np.ndarray:
    """Linear stiffness of each tet for a Poisson ratio of 0 [N/m], shape (n_tet, 12, 12).

    The energy is V E eps : eps / 2 with the strain eps = sym(grad u).
    """
    corners = body.x[body.mesh.tets]
    grad = np.linalg.inv(corners[:, 1:] - corners[:, :1])  # (t, xyz, corners 1 to 3)
    grad = np.concatenate([-grad.sum(axis=2, keepdims=True), grad], axis=2)
    both = np.einsum("tca,tcb->tab", grad, grad)
    k = np.einsum("tab,cd->tacbd", both, np.eye(3)) + np.einsum("tda,tcb->tacbd", grad, grad)
    k *= 0.5 * body.material.youngs_modulus * body.mesh.volumes[:, None, None, None, None]
    return k.reshape(-1, 12, 12)
