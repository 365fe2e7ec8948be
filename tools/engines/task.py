"""What an engine is asked to simulate, and what it hands back."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import warp_contact as wc


class Failed(Exception):
    """A motion that has no error to show; the message is the reason."""


@dataclass(frozen=True, eq=False)  # each run is itself alone, whatever its arrays
class Motion:
    """One run, as positions and velocities after each frame, or the reason why there is none."""

    x: np.ndarray | None = None  # (frames + 1, n, 3) [m], the start included
    v: np.ndarray | None = None  # the same [m/s]
    cpu: float | None = None  # CPU s per simulated s, with detection; None if never timed
    startup: float | None = None  # CPU s up to the end of the first frame: build, compile or load
    steps: int = 0  # of the last frame
    reason: str = ""


def placed(scene: wc.Scene) -> np.ndarray:
    """All vertices of the rest shapes as placed [m], shape (n, 3)."""
    return np.concatenate([body.x for body in scene.bodies])


@dataclass(frozen=True)
class Task:
    """A scene and how to run it."""

    scene: Callable[[], wc.Scene]  # builds what every engine simulates
    fps: float
    frames: int
    stiffness: float = 1.0  # of a penalty about which it is swept [N/m]
    damping: float = 0.0  # of that penalty [N s/m]
    start: Callable[[wc.Scene], np.ndarray] = placed  # positions at the start [m]
    stop: int | None = None  # frame after which held vertices stand still


class Numbered:
    """The bodies of a scene as one set of vertices and tets, numbered through."""

    def __init__(self, scene: wc.Scene):
        bodies = scene.bodies
        starts = np.cumsum([0, *(len(b.x) for b in bodies)]).tolist()
        self.parts = [slice(*ends) for ends in pairwise(starts)]  # vertices of each body
        self.rest = placed(scene)
        self.v = np.concatenate([b.v for b in bodies])  # (n, 3) [m/s], at the start
        self.fixed = np.concatenate([b.fixed for b in bodies])
        self.tets = np.concatenate([b.mesh.tets + k for b, k in zip(bodies, starts, strict=False)])
        share = [np.repeat(0.25 * b.material.density * b.mesh.volumes, 4) for b in bodies]
        self.mass = np.bincount(self.tets.ravel(), np.concatenate(share))  # (n,) [kg]
