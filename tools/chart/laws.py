"""Elastic forces and energies from positions alone, in double precision, for any engine.

    neo-hookean  psi = mu/2 (I_C - 3) - mu (J - 1) + (lam + mu)/2 (J - 1)^2
                 P   = mu F + ((lam + mu)(J - 1) - mu) cof F
    st-venant    psi = mu E : E + lam/2 (tr E)^2,  P = F (2 mu E + lam tr E I)

with the Green strain E = (F^T F - I)/2. An engine is judged by the law it simulates; both laws
agree at small strains. Sources: Smith, de Goes, Kim 2018; Ogden 1997, Non-linear Elastic
Deformations.
"""

import numpy as np
from verification.setup import gradients

STEPS = 12  # of a fixed-point iteration from small strain; each gains a digit or so at 10 %


class Elastic:
    """Bodies as one set of linear tets under one law."""

    def __init__(self, rest: np.ndarray, tets: np.ndarray, lame: np.ndarray, law: str):
        """Take rest positions [m], tets, (mu, lam) of each tet [Pa], the name of a law."""
        self.tets, self.law = tets, law
        self.mu, self.lam = np.asarray(lame, dtype=float).T
        self.grad = gradients(np.asarray(rest, dtype=float), tets)
        self.volume = 1.0 / np.linalg.det(self.grad[:, 1:]) / 6.0

    def deformation(self, x: np.ndarray) -> np.ndarray:
        """F of each tet, shape (m, 3, 3)."""
        return np.einsum("tci,tcj->tij", np.asarray(x, dtype=float)[self.tets], self.grad)

    def forces(self, x: np.ndarray) -> np.ndarray:
        """Internal forces on all vertices [N], shape (n, 3)."""
        p = first_piola(self.deformation(x), self.mu, self.lam, self.law)
        out = np.zeros((len(x), 3))
        np.add.at(out, self.tets, -np.einsum("t,tij,tcj->tci", self.volume, p, self.grad))
        return out

    def energy(self, x: np.ndarray) -> float:
        """Elastic energy [J]."""
        f, mu, lam = self.deformation(x), self.mu, self.lam
        green = 0.5 * (np.swapaxes(f, 1, 2) @ f - np.eye(3))
        trace = np.trace(green, axis1=1, axis2=2)
        if self.law == "st-venant":
            density = mu * (green**2).sum(axis=(1, 2)) + 0.5 * lam * trace**2
        else:
            grown = np.linalg.det(f) - 1.0
            density = mu * (trace - grown) + 0.5 * (lam + mu) * grown**2
        return float(self.volume @ density)

    def least_volume(self, x: np.ndarray) -> float:
        """Smallest volume of a tet over its rest volume; negative when inverted."""
        return float(np.linalg.det(self.deformation(x)).min())


def first_piola(f: np.ndarray, mu, lam, law: str) -> np.ndarray:
    """P [Pa] at the deformations ``f``, shape (m, 3, 3)."""
    mu, lam = (np.asarray(value)[..., None, None] for value in (mu, lam))
    if law == "st-venant":
        green = 0.5 * (np.swapaxes(f, -1, -2) @ f - np.eye(3))
        trace = np.trace(green, axis1=-2, axis2=-1)[..., None, None]
        return f @ (2.0 * mu * green + lam * trace * np.eye(3))
    a, b, c = (f[..., :, k] for k in range(3))
    cof = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)
    j = np.linalg.det(f)[..., None, None]
    return mu * f + ((lam + mu) * (j - 1.0) - mu) * cof


def pull(stretch: float, mu: float, lam: float, law: str) -> float:
    """Axial nominal stress [Pa] of a bar with free sides at ``stretch``."""

    def stress(side: float) -> np.ndarray:
        return first_piola(np.diag([side, side, stretch])[None], mu, lam, law)[0]

    side, tangent = 1.0, 2.0 * (lam + mu)
    for _ in range(STEPS):
        side -= stress(side)[0, 0] / tangent
    return float(stress(side)[2, 2])


def squeeze(pressure: float, mu: float, lam: float, law: str) -> float:
    """The stretch at which a bar with free sides carries ``pressure`` [Pa]."""
    young = mu * (3.0 * lam + 2.0 * mu) / (lam + mu)
    stretch = 1.0
    for _ in range(STEPS):
        stretch -= (pull(stretch, mu, lam, law) + pressure) / young
    return stretch
