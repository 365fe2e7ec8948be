"""What is timed: six scenes, piles of more and more spheres, more and more worlds, mesh orders."""

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

RADIUS = 0.05  # of a sphere [m]
BALL = 41  # its vertices
LAYERS = 4  # of a pile
YOUNG, POISSON, DENSITY = 2e4, 0.35, 1000.0  # [Pa], [-], [kg/m^3]
DAMPING = 1e-3  # [s]


@dataclass(frozen=True)
class Case:
    """One scene to time.

    Attributes:
        build: the scene
        frames: to run before
        series: those of the same name are compared by their number of vertices
    """

    build: Callable[[], wc.Scene]
    frames: int
    series: str = ""


def cases(quick: bool, large: bool, fraction: float) -> dict[str, Case]:
    """All cases by name."""
    found = {}
    for name in scenes.names():
        settings = {"fraction": fraction} if name == "bowl" else {}
        found[name] = Case(partial(scenes.load(name).build, **settings), FRAMES[name])
    piles = PILES[: 2 if quick else None] + (LARGE_PILE,) * large
    worlds = WORLDS[: 2 if quick else None] + (LARGE_WORLDS,) * large
    for n in piles:
        found[f"pile_{n}"] = Case(partial(pile, n), SERIES_FRAMES, "pile")
    for n in worlds:
        found[f"worlds_{n}"] = Case(partial(copies, n), SERIES_FRAMES, "worlds")
    for order in () if quick else ORDERS:
        found[f"block_{order}"] = Case(partial(block, order), 1)
    return found


def rubber() -> wc.NeoHookean:
    """The material of all spheres."""
    return wc.NeoHookean(YOUNG, POISSON, DENSITY, DAMPING)


def ball() -> wc.TetMesh:
    """A coarse sphere that stands on a triangle."""
    return wc.sphere(RADIUS, BALL).transformed(rotation_matrix(squeezed_sphere.TURN))


def pile(vertices: int, friction: float = 0.3) -> wc.Scene:
    """About so many vertices of spheres in a lattice of some layers, which just touch."""
    scene = wc.Scene(friction=friction)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    mesh, material = ball(), rubber()
    columns = max(1, round(vertices / (BALL * LAYERS)))
    side = math.ceil(math.sqrt(columns))
    size = mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)
    for k in range(columns * LAYERS):
        i, layer = divmod(k, LAYERS)
        place = size * (i % side, i // side, layer)
        scene.add_body(mesh, material, (*place[:2], place[2] - mesh.vertices[:, 2].min()))
    return scene


def copies(count: int) -> wc.Scene:
    """``squeezed_sphere`` so many times, all at the same place, each in a world of its own."""
    one = squeezed_sphere.build()
    shapes = [wc.TetMesh(body.x, body.mesh.tets) for body in one.bodies]  # where they stand
    scene = wc.Scene(one.gravity, one.friction)
    for world in range(count):
        for body, shape in zip(one.bodies, shapes, strict=True):
            scene.add_body(
                shape,
                body.material,
                velocity=body.v,
                fixed=body.fixed,
                label=f"{body.label}_{world}",
                world=world,
            )
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
    scene.add_body(mesh, rubber())
    return scene
