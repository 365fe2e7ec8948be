"""Fruits of several shapes fall into a dish.

The paper's Fig. 9, with its 16030 vertices and 27116 surface triangles: a dish that does not move
and 332 coarse fruits, apples, lemons, melons and bananas. Look at the pile: it comes to rest with
every fruit lying on its neighbours, although any two touch at only a few vertices.

The fruits start in layers that alternate between the shapes, low above the dish, with a seeded
jitter. Each keeps to its own slot, an upright cylinder that contains it, so nothing overlaps.
"""

from collections.abc import Iterator

import numpy as np

from warp_contact.scene.materials import NeoHookean
from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.scene import Scene
from warp_contact.scene.shapes import dish, drum, sphere

DISH: dict = {"radius": 0.5, "depth": 0.4, "thickness": 0.035, "rings": 14}  # [m]
COUNTS = {"melon": 46, "banana": 64, "apple": 111, "lemon": 111}
LAYERS = ("melon", "round", "banana", "round")  # from below, over and over; round: apple or lemon
# Radius and half height of the upright cylinder that contains a fruit however it is turned [m].
SLOTS = {"melon": (0.072, 0.062), "banana": (0.084, 0.024), "round": (0.045, 0.045)}
REACH = 0.42  # no slot is further from the axis [m]
SLACK = 0.004  # between slots [m]
START = 0.08  # lowest point of the lowest slots [m]
YOUNG = 1e5  # [Pa]
POISSON = 0.35  # [-]
DENSITY = 900.0  # [kg/m^3]
DAMPING = 1e-3  # [s]
SEED = 5

FRAMES = 120
VIEW = {"eye": (0.85, -2.3, 1.55), "target": (0.0, 0.0, 0.45)}
PENALTY = {"stiffness": 2000.0, "damping": 0.5}  # [N/m], [N s/m]: E edge of an element


def build(
    fraction: float = 1.0,
    young: float = YOUNG,
    friction: float = 0.3,
    damping: float = DAMPING,
    seed: int = SEED,
) -> Scene:
    """The dish stands on a floor at z = 0; ``fraction`` of the fruits, for a quick look."""
    rng = np.random.default_rng(seed)
    scene = Scene(friction=friction)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    flesh = NeoHookean(young, POISSON, DENSITY, damping)
    scene.add_body(dish(**DISH), flesh, fixed=True, label="dish")
    shapes, left = fruits(), {kind: round(fraction * n) for kind, n in COUNTS.items()}
    for kind, place in slots(left, rng):
        turn = any_turn(rng) if kind in ("apple", "lemon") else upright_turn(rng)
        label = f"{kind}_{left[kind]}"
        left[kind] -= 1
        scene.add_body(shapes[kind], flesh, place, turn, label=label)
    return scene


def fruits() -> dict[str, TetMesh]:
    """The shape of each kind, about the origin, long in x."""
    return {
        "apple": sphere(0.043, 41),
        "lemon": sphere(0.034, 41).scaled(1.3, 1.0, 1.0),
        "melon": sphere(0.06, 55).scaled(1.18, 1.0, 1.0),
        "banana": banana(length=0.16, radius=0.022, bend=1.0),
    }


def banana(length: float, radius: float, bend: float) -> TetMesh:
    """A tapered bar along x, bent by the angle ``bend`` [rad] in the xy plane."""
    rho, theta, zeta, tets = drum(rings=1, layers=6)
    s = zeta - 0.5
    across = radius * rho * (1.0 - 1.8 * s * s)  # the ends keep 0.55 of the radius
    curve = length / bend
    r = curve + across * np.sin(theta)
    angle = s * bend
    x = np.stack([r * np.sin(angle), r * np.cos(angle), across * np.cos(theta)], axis=1)
    return TetMesh(x - 0.5 * (x.min(axis=0) + x.max(axis=0)), tets)


def slots(counts: dict[str, int], rng: np.random.Generator) -> Iterator[tuple[str, np.ndarray]]:
    """A kind and a place [m] for each fruit, layer by layer upwards until none is left."""
    counts = dict(counts)
    z, k = START, 0
    while any(counts.values()):
        layer = LAYERS[k % len(LAYERS)]
        kinds = ("apple", "lemon") if layer == "round" else (layer,)
        radius, half = SLOTS[layer]
        if any(counts[kind] for kind in kinds):
            for xy in hexagons(2.0 * (radius + SLACK), rng):
                if not clear_of_dish(xy, z, radius):
                    continue
                stock = [kind for kind in kinds if counts[kind]]
                if not stock:
                    break
                kind = stock[rng.integers(len(stock))]
                counts[kind] -= 1
                yield kind, np.array([*(xy + rng.uniform(-0.7, 0.7, 2) * SLACK), z + half])
            z += 2.0 * half + SLACK
        k += 1


def hexagons(spacing: float, rng: np.random.Generator) -> np.ndarray:
    """Points of a triangular lattice, turned and shifted at random, from the axis outwards [m]."""
    k = np.arange(-20, 21)
    a, b = (grid.ravel() for grid in np.meshgrid(k, k))
    angle, shift = rng.uniform(0.0, np.pi / 3.0), rng.uniform(0.0, spacing, 2)
    points = np.stack([spacing * (a + 0.5 * b), spacing * 0.75**0.5 * b], axis=1) + shift
    c, s = np.cos(angle), np.sin(angle)
    points = points @ np.array([[c, s], [-s, c]])
    return points[np.argsort(np.linalg.norm(points, axis=1), kind="stable")]


def clear_of_dish(xy: np.ndarray, z: float, radius: float) -> bool:
    """Whether a slot with its lower end at height ``z`` is above the dish or inside its hollow."""
    wall, depth = DISH["thickness"], DISH["depth"]
    distance = float(np.linalg.norm(xy))
    if z > wall + depth + SLACK:
        return distance < REACH
    curve = 0.5 * (DISH["radius"] ** 2 + depth**2) / depth
    lowest = np.hypot(distance + radius + SLACK, curve + wall - z)
    return distance < REACH and lowest < 0.98 * curve  # the facets cut 0.2 % off the sphere


def any_turn(rng: np.random.Generator) -> np.ndarray:
    """A quaternion (x, y, z, w), uniform over all rotations."""
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def upright_turn(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """A quaternion (x, y, z, w), uniform over the rotations about z."""
    half = rng.uniform(0.0, np.pi)
    return (0.0, 0.0, float(np.sin(half)), float(np.cos(half)))
