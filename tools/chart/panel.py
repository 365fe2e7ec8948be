"""What a panel shows of a run, and the elastic forces by which it is judged.

Forces and energies come from positions alone, in double precision, for any engine:

    psi = mu/2 (I_C - 3) - mu (J - 1) + (lam + mu)/2 (J - 1)^2
    P   = mu F + ((lam + mu)(J - 1) - mu) cof F

the stable neo-Hookean law that all engines simulate. Source: Smith, de Goes, Kim 2018.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from engines.task import Failed, Motion, Numbered, Task
from verification.setup import gradients

import warp_contact as wc


class Elastic(Numbered):
    """The bodies of a scene as linear neo-Hookean tets."""

    def __init__(self, scene: wc.Scene):
        super().__init__(scene)
        lame = [np.tile(b.material.lame(), (len(b.mesh.tets), 1)) for b in scene.bodies]
        self.lame = np.concatenate(lame).T[..., None, None]
        self.grad = gradients(self.rest, self.tets)
        self.volume = 1.0 / np.linalg.det(self.grad[:, 1:]) / 6.0

    def deformation(self, x: np.ndarray) -> np.ndarray:
        """F of each tet, shape (m, 3, 3)."""
        return np.einsum("tci,tcj->tij", np.asarray(x, dtype=float)[self.tets], self.grad)

    def forces(self, x: np.ndarray) -> np.ndarray:
        """Internal forces on all vertices [N], shape (n, 3)."""
        _, p = response(self.deformation(x), *self.lame)
        out = np.zeros((len(x), 3))
        np.add.at(out, self.tets, -np.einsum("t,tij,tcj->tci", self.volume, p, self.grad))
        return out

    def energy(self, x: np.ndarray) -> float:
        """Elastic energy [J]."""
        density, _ = response(self.deformation(x), *self.lame)
        return float(self.volume @ density.ravel())


def response(f: np.ndarray, mu, lam) -> tuple[np.ndarray, np.ndarray]:
    """Densities psi [J/m^3], shape (..., 1, 1), and P [Pa], shape (..., 3, 3), at the given F."""
    stretched = 0.5 * ((f**2).sum(axis=(-2, -1), keepdims=True) - 3.0)
    grown = np.linalg.det(f)[..., None, None] - 1.0
    cof = np.cross(np.roll(f, -1, axis=-1), np.roll(f, -2, axis=-1), axis=-2)
    density = mu * (stretched - grown) + 0.5 * (lam + mu) * grown**2
    return density, mu * f + ((lam + mu) * grown - mu) * cof


class Panel(NamedTuple):
    """An error of the runs of a task."""

    name: str  # short, as in the table
    title: str  # of the panel, and on a second line what the error is
    error: Callable[[Task, Motion], float]  # of a motion; raises ``Failed``


def sound(task: Task, motion: Motion) -> Elastic:
    """The bodies; ``Failed`` where tets end inverted."""
    solid = Elastic(task.scene())
    ratio = float(np.linalg.det(solid.deformation(motion.x[-1])).min())
    if ratio <= 0.0:
        raise Failed(f"tets left inverted (volume ratio {ratio:.2g})")
    return solid


def late(task: Task, part: float = 0.1) -> slice:
    """The frames at the end, two at least; over a tenth of all a state of rest is averaged."""
    return slice(-max(2, round(part * task.frames)), None)
