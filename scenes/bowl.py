"""Fruits of several shapes fall into a dish.

The paper's Fig. 9, with its 16030 vertices and 27116 surface triangles: a dish that does not move
and 332 coarse fruits, apples, lemons, melons and bananas. Look at the pile: it comes to rest with
every fruit lying on its neighbours, although any two touch at only a few vertices.

With ``fine`` each fruit is drawn as a fine surface of its own colours, which follows its coarse
tets, as in the paper's picture; the motion is the same.

The fruits start in layers that alternate between the shapes, low above the dish, with a seeded
jitter. Each keeps to its own slot, an upright cylinder that contains it, so nothing overlaps.
"""

from collections.abc import Iterator

import numpy as np

from warp_contact.scene.materials import NeoHookean
from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.scene import Scene
from warp_contact.scene.shapes import dish, drum, sphere
from warp_contact.scene.surface import Surface

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
BANANA = {"length": 0.16, "radius": 0.022, "bend": 1.0}  # [m], [m], [rad]
# Linear red, green and blue between which a fruit is drawn.
APPLE = (0.55, 0.45, 0.06), (0.5, 0.015, 0.02)
LEMON = (0.85, 0.6, 0.03), (0.4, 0.42, 0.03)
MELON = (0.25, 0.42, 0.09), (0.015, 0.1, 0.025)
PEEL = (0.8, 0.55, 0.04), (0.05, 0.025, 0.01)

FRAMES = 120
VIEW = {"eye": (0.85, -2.3, 1.55), "target": (0.0, 0.0, 0.45)}
PENALTY = {"stiffness": 2000.0, "damping": 0.5}  # [N/m], [N s/m]: E edge of an element


def build(
    fraction: float = 1.0,
    young: float = YOUNG,
    friction: float = 0.3,
    damping: float = DAMPING,
    seed: int = SEED,
    fine: bool = False,
) -> Scene:
    """The dish stands on a floor at z = 0; ``fraction`` of the fruits, for a quick look."""
    rng = np.random.default_rng(seed)
    scene = Scene(friction=friction)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    flesh = NeoHookean(young, POISSON, DENSITY, damping)
    scene.add_body(dish(**DISH), flesh, fixed=True, label="dish")
    drawn = looks() if fine else {}
    shapes, left = fruits(), {kind: round(fraction * n) for kind, n in COUNTS.items()}
    for kind, place in slots(left, rng):
        turn = any_turn(rng) if kind in ("apple", "lemon") else upright_turn(rng)
        label = f"{kind}_{left[kind]}"
        left[kind] -= 1
        scene.add_body(shapes[kind], flesh, place, turn, label=label, render=drawn.get(kind))
    return scene


def fruits() -> dict[str, TetMesh]:
    """The shape of each kind, about the origin, long in x."""
    return {
        "apple": sphere(0.043, 41),
        "lemon": sphere(0.034, 41).scaled(1.3, 1.0, 1.0),
        "melon": sphere(0.06, 55).scaled(1.18, 1.0, 1.0),
        "banana": banana(**BANANA),
    }


def banana(length: float, radius: float, bend: float) -> TetMesh:
    """A tapered bar along x, bent by the angle ``bend`` [rad] in the xy plane."""
    rho, theta, zeta, tets = drum(rings=1, layers=6)
    x = bent(rho, theta, zeta - 0.5, length, radius, bend)
    return TetMesh(x - 0.5 * (x.min(axis=0) + x.max(axis=0)), tets)


def bent(rho, theta, s, length: float, radius: float, bend: float) -> np.ndarray:
    """Points of the bar [m], the middle of its axis at y = length / bend; s is -1/2 to 1/2."""
    across = radius * rho * (1.0 - 1.8 * s * s)  # the ends keep 0.55 of the radius
    r = length / bend + across * np.sin(theta)
    angle = s * bend
    return np.stack([r * np.sin(angle), r * np.cos(angle), across * np.cos(theta)], axis=1)


def looks() -> dict[str, Surface]:
    """The surface of each kind that is drawn, with the volume of its tets."""
    x, tris = globe(28, 14)
    polar, angle = np.arccos(x[:, 2]), np.arctan2(x[:, 1], x[:, 0])
    top, foot = np.exp(-((polar / 0.4) ** 2)), np.exp(-(((np.pi - polar) / 0.4) ** 2))
    ripe = 1.6 * polar - 0.7 + 0.12 * np.sin(5.0 * angle + 2.0 * np.sin(3.0 * angle))
    apple = Surface(x * (1.0 - 0.3 * top - 0.12 * foot)[:, None], tris, colors=mixed(APPLE, ripe))
    x = x[:, [2, 0, 1]]  # poles along x
    tips = np.exp((np.abs(x[:, 0]) - 1.0) / 0.06)
    longer = np.stack([(1.3 + 0.2 * tips) * x[:, 0], x[:, 1], x[:, 2]], axis=1)
    lemon = Surface(longer, tris, colors=mixed(LEMON, tips))
    x, tris = globe(54, 14)
    x = x[:, [2, 0, 1]] * (1.18, 1.0, 1.0)
    stripes = np.sin(9.0 * np.arctan2(x[:, 2], x[:, 1]) + 0.8 * np.sin(7.0 * x[:, 0]))
    melon = Surface(x, tris, colors=mixed(MELON, 0.5 + 0.8 * stripes))
    found = {"apple": apple, "lemon": lemon, "melon": melon, "banana": peel(**BANANA)}
    size = {kind: (mesh.volume / found[kind].volume) ** (1 / 3) for kind, mesh in fruits().items()}
    return {kind: found[kind].transformed(size[kind] * np.eye(3)) for kind in found}


def peel(length: float, radius: float, bend: float) -> Surface:
    """The surface of a banana, with rounded ends."""
    x, tris = globe(16, 22)
    s = 0.5 * x[:, 2]
    round_end = np.sqrt(np.clip(1.0 - ((np.abs(s) - 0.45) / 0.05).clip(0.0) ** 2, 0.0, 1.0))
    points = bent(round_end, np.arctan2(x[:, 0], x[:, 1]), s, length, radius, bend)
    middle = banana(length, radius, bend).vertices[:, 1].max()  # that of the bar, when centred
    points[:, 1] += middle - points[:, 1].max()
    brown = np.exp((np.abs(s) - 0.5) / 0.025)
    return Surface(points, tris, colors=mixed(PEEL, brown))


def globe(around: int, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """A unit sphere with poles along z: points, shape (n, 3), and outward triangles."""
    polar = np.pi * np.arange(1, rings) / rings
    angle = 2.0 * np.pi * np.arange(around) / around
    t, a = np.meshgrid(polar, angle, indexing="ij")
    ring = np.stack([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)], axis=2)
    x = np.concatenate([[[0.0, 0.0, 1.0]], ring.reshape(-1, 3), [[0.0, 0.0, -1.0]]])
    ids = 1 + np.arange(ring[..., 0].size).reshape(ring.shape[:2])
    to = np.roll(ids, -1, axis=1)
    a, b, c, d = ids[:-1].ravel(), ids[1:].ravel(), to[1:].ravel(), to[:-1].ravel()
    first, last = np.zeros(around, dtype=int), np.full(around, len(x) - 1)
    tris = [(first, ids[0], to[0]), (a, b, c), (a, c, d), (last, to[-1], ids[-1])]
    return x, np.concatenate([np.stack(three, axis=1) for three in tris])


def mixed(colors: tuple, share: np.ndarray) -> np.ndarray:
    """Linear colours between two, shape (n, 3), by the share of the second."""
    share = np.clip(share, 0.0, 1.0)[:, None]
    return (1.0 - share) * np.array(colors[0]) + share * np.array(colors[1])


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
