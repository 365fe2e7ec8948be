"""What a panel is, and what a method hands back for it."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

import warp_contact as wc
from charting.laws import Elastic

TUNNELLED = 1.0  # of an edge: an overlap from which a body is on the wrong side
INVERTED = 0.0  # volume ratio at the end


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
class Panel:
    """A setting, and an error of a motion in it.

    Attributes:
        name: short, as in the table
        title: what the error is
        scene: what every method simulates
        fps: frames per second
        frames: how many
        error: of a motion; raises ``Failed``
        stiffness: of a penalty about which it is swept [N/m]
        damping: of that penalty [N s/m]
        start: positions at the start [m] where these are not the rest shapes as placed
        stop: frame after which held vertices stand still
        also: further panels that show other errors of the same runs
    """

    name: str
    title: str
    scene: Callable[[], wc.Scene]
    fps: float
    frames: int
    error: Callable[["Panel", Motion], float]
    stiffness: float
    damping: float = 0.0
    start: Callable[[wc.Scene], np.ndarray] | None = None
    stop: int | None = None
    also: tuple["Panel", ...] = field(default=())


def placed(panel: Panel, scene: wc.Scene) -> np.ndarray:
    """Positions of all vertices at the start [m]."""
    at_rest = np.concatenate([body.x for body in scene.bodies])
    return at_rest if panel.start is None else panel.start(scene)


def elastic(scene: wc.Scene, law: str) -> Elastic:
    """The bodies of a scene under a law."""
    return Elastic(rest(scene), tets(scene), lame(scene), law)


def rest(scene: wc.Scene) -> np.ndarray:
    """Rest shapes as placed [m]."""
    return np.concatenate([body.x for body in scene.bodies])


def tets(scene: wc.Scene) -> np.ndarray:
    """Tets of all bodies, numbered through."""
    return np.concatenate([b.mesh.tets + first for b, first in zip(*_starts(scene), strict=True)])


def lame(scene: wc.Scene) -> np.ndarray:
    """(mu, lam) of each tet [Pa]."""
    return np.concatenate([np.tile(b.material.lame(), (len(b.mesh.tets), 1)) for b in scene.bodies])


def masses(scene: wc.Scene) -> np.ndarray:
    """A quarter of the mass of each tet at each of its corners [kg]."""
    parts = []
    for body in scene.bodies:
        share = np.repeat(0.25 * body.material.density * body.mesh.volumes, 4)
        parts.append(np.bincount(body.mesh.tets.ravel(), share, minlength=len(body.x)))
    return np.concatenate(parts)


def part(scene: wc.Scene, index: int) -> slice:
    """Where the vertices of a body stand among all."""
    first = _starts(scene)[1][index]
    return slice(first, first + len(scene.bodies[index].x))


def sound(panel: Panel, motion: Motion) -> None:
    """Raise ``Failed`` for a motion that is not finite or ends with inverted tets."""
    if not np.isfinite(motion.x).all():
        raise Failed("not finite")
    ratio = elastic(panel.scene(), motion.law).least_volume(motion.x[-1])
    if ratio <= INVERTED:
        raise Failed(f"tets left inverted (volume ratio {ratio:.2g})")


def _starts(scene: wc.Scene) -> tuple[list, list[int]]:
    counts = [len(body.x) for body in scene.bodies]
    return scene.bodies, [sum(counts[:k]) for k in range(len(counts))]
