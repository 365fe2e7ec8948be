"""What an engine is asked to simulate, and what it hands back."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import warp_contact as wc


class Failed(Exception):
    """A run that has no error to show; the message is the reason."""

    def __init__(self, reason: str, wall: float | None = None):
        """``wall``: seconds per simulated second, where something could be timed."""
        super().__init__(reason)
        self.wall = wall


@dataclass
class Motion:
    """One run, as positions and velocities after each frame."""

    x: np.ndarray  # (frames + 1, n, 3) [m], the start included
    v: np.ndarray  # the same [m/s]
    law: str  # of elasticity, by which the engine is judged
    wall: float  # seconds per simulated second; contact detection inside, start-up outside
    startup: float  # seconds up to the end of the first frame: build, compile or load kernels
    steps: int  # of the last frame


@dataclass(frozen=True)
class Task:
    """A scene and how to run it."""

    scene: Callable[[], wc.Scene]  # builds what every engine simulates
    fps: float
    frames: int
    stiffness: float = 1.0  # of a penalty about which it is swept [N/m]
    damping: float = 0.0  # of that penalty [N s/m]
    # Positions at the start [m] where these are not the rest shapes as placed.
    start: Callable[[wc.Scene], np.ndarray] | None = None
    stop: int | None = None  # frame after which held vertices stand still

    def placed(self, scene: wc.Scene) -> np.ndarray:
        """Positions of all vertices at the start [m]."""
        return Numbered(scene).rest if self.start is None else self.start(scene)


class Numbered:
    """The bodies of a scene as one set of vertices and tets, numbered through."""

    def __init__(self, scene: wc.Scene):
        bodies = scene.bodies
        starts = np.cumsum([0, *(len(b.x) for b in bodies)]).tolist()
        self.parts = [slice(*ends) for ends in pairwise(starts)]  # vertices of each body
        self.rest = np.concatenate([b.x for b in bodies])  # (n, 3) [m], as placed
        self.mass = np.concatenate([_masses(b) for b in bodies])  # (n,) [kg], a quarter of each tet
        self.tets = np.concatenate([b.mesh.tets + k for b, k in zip(bodies, starts, strict=False)])
        lame = [np.tile(b.material.lame(), (len(b.mesh.tets), 1)) for b in bodies]
        self.lame = np.concatenate(lame)  # (m, 2) [Pa]: mu, lam


def _masses(body) -> np.ndarray:
    share = np.repeat(0.25 * body.material.density * body.mesh.volumes, 4)
    return np.bincount(body.mesh.tets.ravel(), share, minlength=len(body.x))
