"""What an engine is asked to simulate, and what it hands back."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import warp_contact as wc


class Failed(Exception):
    """A run that has no error to show; the message is the reason.

    Attributes:
        wall: seconds per simulated second, where something could be timed
    """

    def __init__(self, reason: str, wall: float | None = None):
        """Give the reason, and the time it took to fail."""
        super().__init__(reason)
        self.wall = wall


@dataclass
class Motion:
    """One run, as positions and velocities after each frame.

    Attributes:
        x: [m], shape (frames + 1, n, 3), the start included
        v: [m/s], the same shape
        law: of elasticity, by which the engine is judged
        wall: seconds per simulated second; contact detection inside, start-up outside
        startup: seconds up to the end of the first frame: build, compile or load kernels
        steps: of the last frame
    """

    x: np.ndarray
    v: np.ndarray
    law: str
    wall: float
    startup: float
    steps: int


@dataclass(frozen=True)
class Task:
    """A scene and how to run it.

    Attributes:
        scene: builds what every engine simulates
        fps: frames per second
        frames: how many
        stiffness: of a penalty about which it is swept [N/m]
        damping: of that penalty [N s/m]
        start: positions at the start [m] where these are not the rest shapes as placed
        stop: frame after which held vertices stand still
    """

    scene: Callable[[], wc.Scene]
    fps: float
    frames: int
    stiffness: float = 1.0
    damping: float = 0.0
    start: Callable[[wc.Scene], np.ndarray] | None = None
    stop: int | None = None

    def placed(self, scene: wc.Scene) -> np.ndarray:
        """Positions of all vertices at the start [m]."""
        return Numbered(scene).rest if self.start is None else self.start(scene)


class Numbered:
    """The bodies of a scene as one set of vertices and tets, numbered through.

    Attributes:
        parts: where the vertices of each body stand among all, slices
        rest: rest shapes as placed [m], shape (n, 3)
        mass: a quarter of the mass of each tet at each of its corners [kg], shape (n,)
        tets: vertices of each tet, shape (m, 4)
        lame: (mu, lam) of each tet [Pa], shape (m, 2)
    """

    def __init__(self, scene: wc.Scene):
        """Number them."""
        bodies = scene.bodies
        starts = np.cumsum([0, *(len(b.x) for b in bodies)]).tolist()
        self.parts = [slice(*ends) for ends in pairwise(starts)]
        self.rest = np.concatenate([b.x for b in bodies])
        self.mass = np.concatenate([_masses(b) for b in bodies])
        self.tets = np.concatenate([b.mesh.tets + p.start for b, p in self.with_parts(scene)])
        lame = [np.tile(b.material.lame(), (len(b.mesh.tets), 1)) for b in bodies]
        self.lame = np.concatenate(lame)

    def with_parts(self, scene: wc.Scene):
        """Each body with its part."""
        return zip(scene.bodies, self.parts, strict=True)


def _masses(body) -> np.ndarray:
    share = np.repeat(0.25 * body.material.density * body.mesh.volumes, 4)
    return np.bincount(body.mesh.tets.ravel(), share, minlength=len(body.x))
