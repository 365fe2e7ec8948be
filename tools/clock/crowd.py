"""The same 64 spheres: apart, in touching pairs, each on a floor, in a pile."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

import warp_contact as wc
from clock.cases import BALL, ball, pile, rubber

COUNT = 64  # spheres
SQUARE = 4  # of them have four pairs between them
PAIRS = 1, 4, 16, 64
SPEED = 0.3  # of each sphere, at random or toward the middle of its square [m/s]
APART = 3.0  # between spheres that do not touch, in diameters
FRAMES = 1, 20, 40  # at 60 a second until pairs touch, spheres have settled on a floor, a pile has
QUICK = 1, 6, 12
SEED = 3


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        name: what is special about it
        build: the scene, for a coefficient of friction
        frames: to run before
        pairs: that touch, None where they were not counted
    """

    name: str
    build: Callable[[float], wc.Scene]
    frames: int
    pairs: int | None = None


def rows(quick: bool) -> list[Row]:
    """All lines of the table."""
    near, floor, heap = QUICK if quick else FRAMES
    found = [Row("apart", partial(squares, 0), near, 0)]
    for pairs in PAIRS:
        found.append(Row(f"{pairs} pairs", partial(squares, pairs), near, pairs))
    for name, bed in (("plane", lay_plane), ("mesh", lay_mesh)):
        found.append(Row(f"on a {name}", partial(spread, bed), floor))
    for name, bed in (("plane", lay_plane), ("mesh", lay_mesh)):
        found.append(Row(f"pile on a {name}", partial(heaped, bed), heap))
    return found


def squares(pairs: int, friction: float) -> wc.Scene:
    """Without gravity, squares of four, the first of them closed until so many pairs touch."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    mesh, material = ball(), rubber()
    size = mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)
    rng = np.random.default_rng(SEED)
    for k in range(COUNT):
        square, corner = divmod(k, SQUARE)
        touching = square < pairs // SQUARE or (pairs == 1 and k < 2)
        at = np.array([corner % 2, corner // 2, 0.0])
        if touching:
            velocity = [0.5, 0.5 if pairs > 1 else 0.0, 0.0] - at
        else:
            velocity = rng.normal(size=3)
        velocity *= SPEED / np.linalg.norm(velocity)
        origin = 3.0 * APART * np.array([square % 4, square // 4, 0.0])
        place = size * (origin + (1.0 if touching else APART) * at)
        scene.add_body(mesh, material, place, velocity=velocity)
    return scene


def spread(bed: Callable, friction: float) -> wc.Scene:
    """Each sphere on the floor by itself."""
    scene = wc.Scene(friction=friction)
    mesh, material = ball(), rubber()
    size = mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)
    side = round(COUNT**0.5)
    bed(scene, APART * side * size[0])
    for k in range(COUNT):
        x, y = APART * size[:2] * (np.array(divmod(k, side)) - 0.5 * (side - 1))
        scene.add_body(mesh, material, (x, y, -mesh.vertices[:, 2].min()))
    return scene


def heaped(bed: Callable, friction: float) -> wc.Scene:
    """A pile of all spheres that collapses."""
    heap = pile(COUNT * BALL)
    scene = wc.Scene(friction=friction)
    middle = np.mean([body.x.mean(axis=0) for body in heap.bodies], axis=0) * (1.0, 1.0, 0.0)
    bed(scene, 1.5)
    for body in heap.bodies:
        place = body.x.mean(axis=0) - body.mesh.vertices.mean(axis=0)
        scene.add_body(body.mesh, body.material, place - middle)
    return scene


def blocks(columns: int = 16, height: int = 2) -> wc.Scene:
    """Columns of blocks that come to rest; balls would roll on."""
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    mesh = wc.box(0.1, 2)
    material = wc.NeoHookean(3e4, 0.3, 1000.0, damping=1e-2)
    for k in range(columns * height):
        column, level = divmod(k, height)
        scene.add_body(mesh, material, (0.2 * column, 0.0, 0.051 + 0.102 * level))
    return scene


def lay_plane(scene: wc.Scene, width: float) -> None:
    """A half-space below z = 0; it has no ``width``."""
    del width
    scene.add_plane((0.0, 0.0, 1.0), 0.0)


def lay_mesh(scene: wc.Scene, width: float) -> None:
    """A slab that does not move, its top at z = 0 [m]."""
    thickness = 0.1
    slab = wc.box(
        (width, width, thickness), (round(width / thickness), round(width / thickness), 1)
    )
    scene.add_body(slab, rubber(), (0.0, 0.0, -0.5 * thickness), fixed=True, label="floor")
