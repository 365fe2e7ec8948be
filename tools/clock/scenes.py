"""What is timed: six scenes, piles of more and more spheres, more and more worlds, mesh orders.

``rows`` are those of ``tools/economy.py``: the same 64 spheres in ever more contact.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

import warp_contact as wc
from warp_contact import scenes
from warp_contact.scene.scene import rotation_matrix
from warp_contact.scenes import squeezed_sphere

FRAMES = {  # until there are contacts; at 60 frames a second
    "bowl": 24,
    "cubes_on_membrane": 8,
    "membrane_stack": 10,
    "sampling": 8,
    "squeezed_sphere": 6,
    "two_bodies": 4,
}
FRACTION = 0.1  # of the fruits in the bowl
PILES = 1_000, 10_000, 100_000  # vertices
WORLDS = 1, 16, 256
LARGE_PILE, LARGE_WORLDS = 1_000_000, 4096
SERIES_FRAMES = 4  # of a pile or of worlds
ORDERS = "generated", "shuffled", "reordered"
CELLS = 40  # along a block of 1 m, in these orders

BALL, RADIUS = 41, 0.05  # vertices of a sphere, and its radius [m]
LAYERS = 4  # of a pile
RUBBER = wc.NeoHookean(2e4, 0.35, 1000.0, 1e-3)

COUNT = 64  # spheres of the rows
SQUARE = 4  # of them have four pairs between them
PAIRS = 1, 4, 16, 64
SPEED = 0.3  # of each sphere, at random or toward the middle of its square [m/s]
APART = 3.0  # between spheres that do not touch, in diameters
SETTLED, QUICK = (1, 20, 40), (1, 6, 12)  # frames until pairs touch, spheres lie, a pile does
SEED = 3


@dataclass(frozen=True)
class Case:
    """One scene to time."""

    build: Callable[..., wc.Scene]  # those of the rows take the coefficient of friction
    frames: int  # to run before
    series: str = ""  # those of the same name are compared by their number of vertices
    pairs: int | None = None  # that touch, None where they were not counted


def cases(quick: bool, large: bool, fraction: float) -> dict[str, Case]:
    """The cases of ``tools/bench.py`` by name."""
    found = {}
    for name in scenes.names():
        settings = {"fraction": fraction} if name == "bowl" else {}
        found[name] = Case(partial(scenes.load(name).build, **settings), FRAMES[name])
    for n in PILES[: 2 if quick else None] + (LARGE_PILE,) * large:
        found[f"pile_{n}"] = Case(partial(pile, n), SERIES_FRAMES, "pile")
    for n in WORLDS[: 2 if quick else None] + (LARGE_WORLDS,) * large:
        found[f"worlds_{n}"] = Case(partial(copies, n), SERIES_FRAMES, "worlds")
    for order in () if quick else ORDERS:
        found[f"block_{order}"] = Case(partial(block, order), 1)
    return found


def rows(quick: bool) -> dict[str, Case]:
    """The lines of the table of ``tools/economy.py`` by name."""
    near, floor, heap = QUICK if quick else SETTLED
    found = {"apart": Case(partial(squares, 0), near, pairs=0)}
    for pairs in PAIRS:
        found[f"{pairs} pairs"] = Case(partial(squares, pairs), near, pairs=pairs)
    for start, layout, frames in (("on", spread, floor), ("pile on", heaped, heap)):
        for name, bed in (("plane", lay_plane), ("mesh", lay_mesh)):
            found[f"{start} a {name}"] = Case(partial(layout, bed), frames)
    return found


def ball() -> tuple[wc.TetMesh, np.ndarray, float]:
    """A coarse sphere that stands on a triangle, its extents and how deep it reaches [m]."""
    mesh = wc.sphere(RADIUS, BALL).transformed(rotation_matrix(squeezed_sphere.TURN))
    return mesh, np.ptp(mesh.vertices, axis=0), -mesh.vertices[:, 2].min()


def pile(vertices: int) -> wc.Scene:
    """About so many vertices of spheres in a lattice of some layers, which just touch."""
    scene = wc.Scene(friction=0.3)
    lay_plane(scene)
    mesh, size, depth = ball()
    columns = max(1, round(vertices / (BALL * LAYERS)))
    side = math.ceil(math.sqrt(columns))
    for k in range(columns * LAYERS):
        i, layer = divmod(k, LAYERS)
        place = size * (i % side, i // side, layer)
        scene.add_body(mesh, RUBBER, place + np.array([0.0, 0.0, depth]))
    return scene


def copies(count: int) -> wc.Scene:
    """``squeezed_sphere`` so many times, all at the same place, each in a world of its own."""
    one = squeezed_sphere.build()
    shapes = [wc.TetMesh(body.x, body.mesh.tets) for body in one.bodies]  # where they stand
    scene = wc.Scene(one.gravity, one.friction)
    for world in range(count):
        for body, shape in zip(one.bodies, shapes, strict=True):
            same = {"velocity": body.v, "fixed": body.fixed, "label": f"{body.label}_{world}"}
            scene.add_body(shape, body.material, world=world, **same)
    return scene


def block(order: str) -> wc.Scene:
    """One fine block in flight: what the numbering of a mesh costs."""
    mesh = wc.box(1.0, CELLS)
    if order != "generated":
        rng = np.random.default_rng(0)
        old = rng.permutation(len(mesh.vertices))
        tets = np.argsort(old)[mesh.tets][rng.permutation(len(mesh.tets))]
        mesh = wc.TetMesh(mesh.vertices[old], tets)
    if order == "reordered":
        mesh = mesh.reordered()[0]
    scene = wc.Scene(friction=0.0)
    scene.add_body(mesh, RUBBER)
    return scene


def squares(pairs: int, friction: float) -> wc.Scene:
    """Without gravity, squares of four, the first of them closed until so many pairs touch."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    mesh, size, _ = ball()
    rng = np.random.default_rng(SEED)
    for k in range(COUNT):
        square, corner = divmod(k, SQUARE)
        touching = square < pairs // SQUARE or (pairs == 1 and k < 2)
        at = np.array([corner % 2, corner // 2, 0.0])
        v = rng.normal(size=3) if not touching else [0.5, 0.5 if pairs > 1 else 0.0, 0.0] - at
        v *= SPEED / np.linalg.norm(v)
        origin = 3.0 * APART * np.array([square % 4, square // 4, 0.0])
        place = size * (origin + (1.0 if touching else APART) * at)
        scene.add_body(mesh, RUBBER, place, velocity=v)
    return scene


def spread(bed: Callable, friction: float) -> wc.Scene:
    """Each sphere on the floor by itself."""
    scene = wc.Scene(friction=friction)
    mesh, size, depth = ball()
    side = round(COUNT**0.5)
    bed(scene, APART * side * size[0])
    for k in range(COUNT):
        x, y = APART * size[:2] * (np.array(divmod(k, side)) - 0.5 * (side - 1))
        scene.add_body(mesh, RUBBER, (x, y, depth))
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
    lay_plane(scene)
    mesh, material = wc.box(0.1, 2), wc.NeoHookean(3e4, 0.3, 1000.0, damping=1e-2)
    for k in range(columns * height):
        column, level = divmod(k, height)
        scene.add_body(mesh, material, (0.2 * column, 0.0, 0.051 + 0.102 * level))
    return scene


def lay_plane(scene: wc.Scene, width: float = math.inf) -> None:
    """A half-space below z = 0; it has no ``width``."""
    del width
    scene.add_plane((0.0, 0.0, 1.0), 0.0)


def lay_mesh(scene: wc.Scene, width: float) -> None:
    """A slab that does not move, its top at z = 0 [m]."""
    cells = round(width / 0.1)
    slab = wc.box((width, width, 0.1), (cells, cells, 1))
    scene.add_body(slab, RUBBER, (0.0, 0.0, -0.05), fixed=True, label="floor")
