"""A setting: bodies in a scene, for how long, and what is watched; a case: what ought to become."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

import warp_contact as wc
from trials.outcome import FINE

DOWN, NONE, UP = (0.0, 0.0, -9.81), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
BASE = 0.01  # of its height: vertices that are no further from its lowest ones are a body's base


@dataclass
class Setting:
    """A scene, how long to run it and what to look at."""

    scene: wc.Scene
    seconds: float  # [s]
    fps: float = 200.0
    substeps: int | None = None  # of a frame; None leaves it to the solver
    # Indices of two bodies and the unit vector from the first to the second, upwards if left out;
    # None watches each body and the next.
    pairs: tuple | None = None
    recovers: bool = False  # it starts with an overlap: only that at the end counts, none may pop
    held: float = 0.0  # lower bound of the elastic energy with that overlap closed at once [J]
    drive: Callable | None = None  # called before each frame; the energy is then not judged


class Case(NamedTuple):
    """A setting, and what ought to come of it."""

    name: str  # number in the specification and a few words
    build: Callable[[], Setting]
    expect: str = FINE  # or ``beyond``: refused though it has a meaning


def case(name: str, build: Callable, *args, expect=FINE, **named) -> Case:
    """The case whose setting is ``build(*args, **named)``."""
    return Case(name, partial(build, *args, **named), expect)


def soft(young: float = 1e5, density: float = 1000.0, poisson: float = 0.4) -> wc.NeoHookean:
    """A material without damping: nothing but the contact may take energy out."""
    return wc.NeoHookean(young, poisson, density)


def body(mesh: wc.TetMesh, material=None, at=NONE, turn=(0.0, 0.0, 0.0, 1.0), v=NONE, **more):
    """The arguments of ``Scene.add_body``.

    Args:
        mesh: rest shape
        material: ``soft()`` if None
        at: where it is put [m]; a number is its height
        turn: as a quaternion
        v: velocity [m/s]; a number is that upwards
        more: the others; ``fixed`` may be "base", its lowest vertices
    """
    if isinstance(more.get("fixed"), str):
        z = mesh.vertices[:, 2]
        more["fixed"] = z < z.min() + BASE * np.ptp(z)
    at, v = ((0.0, 0.0, a) if np.isscalar(a) else a for a in (at, v))
    given = {"mesh": mesh, "material": material or soft(), "position": at, "rotation": turn}
    return given | {"velocity": v} | more


def scene(*bodies: dict, gravity=DOWN, friction=0.3, planes=(), restitution=0.0) -> wc.Scene:
    """Bodies on the half-spaces above the planes through the origin with these normals."""
    made = wc.Scene(gravity, friction, restitution)
    for normal in planes:
        made.add_plane(normal)
    for arguments in bodies:
        made.add_body(**arguments)
    return made


def setting(
    *bodies: dict, seconds: float, gravity=DOWN, friction=0.3, planes=(), **watched
) -> Setting:
    """The scene of these bodies; see ``Setting``."""
    made = scene(*bodies, gravity=gravity, friction=friction, planes=planes)
    return Setting(made, seconds, **watched)
