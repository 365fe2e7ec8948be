"""What is timed: six scenes, piles of more and more spheres, worlds, mesh orders, few contacts."""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from trials.setting import NONE, UP, body, scene

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

COUNT = 64  # spheres of which some touch
PAIRS = 0, 1, 4, 16, 64  # that touch
SPEED = 0.3  # of each sphere, at random or toward the middle of its square [m/s]
APART = 3.0  # between spheres that do not touch, in diameters
SEED = 3


class Case(NamedTuple):
    """One scene to time."""

    build: Callable[..., wc.Scene]
    frames: int  # to run before
    series: str = ""  # those of the same name are compared by their number of vertices
    substeps: int | None = None  # of a frame; None leaves them to the simulation


def cases(large: bool, fraction: float) -> dict[str, Case]:
    """The cases of ``tools/bench.py`` by name."""
    found = {name: Case(scenes.load(name).build, frames) for name, frames in FRAMES.items()}
    found["bowl"] = Case(partial(found["bowl"].build, fraction=fraction), FRAMES["bowl"])
    for n in PILES + (LARGE_PILE,) * large:
        found[f"pile_{n}"] = Case(partial(pile, n), SERIES_FRAMES, "pile")
    for n in WORLDS + (LARGE_WORLDS,) * large:
        found[f"worlds_{n}"] = Case(partial(copies, n), SERIES_FRAMES, "worlds")
    found |= {f"pairs_{n}": Case(partial(squares, n), 1, substeps=20) for n in PAIRS}
    return found | {f"block_{order}": Case(partial(block, order), 1) for order in ORDERS}


def ball() -> tuple[wc.TetMesh, np.ndarray, float]:
    """A coarse sphere that stands on a triangle, its extents and how deep it reaches [m]."""
    mesh = wc.sphere(RADIUS, BALL).transformed(rotation_matrix(squeezed_sphere.TURN))
    return mesh, np.ptp(mesh.vertices, axis=0), -mesh.vertices[:, 2].min()


def pile(vertices: int) -> wc.Scene:
    """About so many vertices of spheres in a lattice of some layers, which just touch."""
    mesh, size, depth = ball()
    columns = max(1, round(vertices / (BALL * LAYERS)))
    side = math.ceil(math.sqrt(columns))
    places = (size * (k % side, k // side, z) for k in range(columns) for z in range(LAYERS))
    return scene(*(body(mesh, RUBBER, at + [0.0, 0.0, depth]) for at in places), planes=[UP])


def copies(count: int) -> wc.Scene:
    """``squeezed_sphere`` so many times, all at the same place, each in a world of its own."""
    one, bodies = squeezed_sphere.build(), []
    shapes = [wc.TetMesh(b.x, b.mesh.tets) for b in one.bodies]  # where they stand
    for world in range(count):
        for b, shape in zip(one.bodies, shapes, strict=True):
            bodies.append(body(shape, b.material, v=b.v, fixed=b.fixed, world=world))
    return scene(*bodies, gravity=one.gravity, friction=one.friction)


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
    return scene(body(mesh, RUBBER), friction=0.0)


def squares(pairs: int) -> wc.Scene:
    """Without gravity, squares of four, the first of them closed until so many pairs touch."""
    mesh, size, _ = ball()
    rng, bodies = np.random.default_rng(SEED), []
    for k in range(COUNT):
        square, corner = divmod(k, 4)
        touching = square < pairs // 4 or (pairs == 1 and k < 2)
        at = np.array([corner % 2, corner // 2, 0.0])
        v = rng.normal(size=3) if not touching else [0.5, 0.5 if pairs > 1 else 0.0, 0.0] - at
        v *= SPEED / np.linalg.norm(v)
        origin = 3.0 * APART * np.array([square % 4, square // 4, 0.0])
        place = size * (origin + (1.0 if touching else APART) * at)
        bodies.append(body(mesh, RUBBER, place, v=v))
    return scene(*bodies, gravity=NONE)


def blocks() -> wc.Scene:
    """16 columns of two blocks that come to rest; balls would roll on."""
    mesh, material = wc.box(0.1, 2), wc.NeoHookean(3e4, 0.3, 1000.0, damping=1e-2)
    places = [(0.2 * k, 0.0, z) for k in range(16) for z in (0.051, 0.153)]
    return scene(*(body(mesh, material, at) for at in places), planes=[UP])
