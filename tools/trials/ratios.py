"""B3: bodies of very unequal mass or stiffness on each other, or that hardly carry themselves."""

from collections.abc import Iterator
from functools import partial

import numpy as np

import warp_contact as wc
from trials.case import DOWN, UP, Case, soft
from trials.watch import Setting


def cases(quick: bool) -> Iterator[Case]:
    """Every one; the quick run is shorter and leaves out the stiffest mats."""
    yield Case("B3a cube of mass 10^4 on a small one", partial(heavy, 0.3 if quick else 3.0))
    yield Case("B3a cube of mass 10^4 strikes a small one at 5 m/s", partial(heavy, 0.1, 5.0))
    for top in (True, False):
        where = "on" if top else "below"
        yield Case(
            f"B3b soft mat {where} a stiff board, 1:10^4",
            partial(board, top, 0.1 if quick else 1.0),
        )
    yield Case(
        "B3c stiff ball on a mat whose ends are pulled", partial(pulled, 0.3 if quick else 2.0)
    )
    for young in (1e2, 1e4, 1e6) if quick else (1e2, 1e4, 1e6, 1e8):
        yield Case(f"B3 mat of E {young:g} on one of 10^4", partial(mats, young, 0.3))
    for ratio in (1e2, 1e4):
        yield Case(f"B3 densities 1:{ratio:g}, heavy on light", partial(column, ratio, 1.0, 0.3))
        yield Case(
            f"B3 densities {ratio:g}:1, light on heavy", partial(column, 1.0 / ratio, 1.0, 0.3)
        )
        yield Case(f"B3 stiffness 1:{ratio:g}, stiff on soft", partial(column, 1.0, ratio, 0.3))
        yield Case(
            f"B3 stiffness {ratio:g}:1, soft on stiff", partial(column, 1.0, 1.0 / ratio, 0.3)
        )
    yield Case("B3 block of a weight of 4 moduli, nothing else", partial(own_weight, 4.0))


def own_weight(moduli: float) -> Setting:
    """A block, held at its base, whose weight over its section is so many times its modulus.

    There is no contact: what goes inside out here does so by its material (kernels/neo_hookean.py).
    """
    scene = wc.Scene(DOWN)
    block = wc.box(0.1, 3)
    young = 1000.0 * 9.81 * 0.1 / moduli
    scene.add_body(block, soft(young), fixed=block.vertices[:, 2] < -0.049)
    return Setting(scene, 0.1, 600.0, pairs=())


def heavy(seconds: float, speed: float = 0.0) -> Setting:
    """At rest the pressure on the small cube is ten times its Young's modulus."""
    scene = wc.Scene(DOWN, friction=0.5)
    scene.add_plane(UP)
    scene.add_body(wc.box(0.1, 2), soft(1e6), (0.0, 0.0, 0.0505), label="small")
    scene.add_body(
        wc.box(1.0, 2),
        soft(1e8, 1e4),
        (0.0, 0.0, 0.602),
        velocity=(0.0, 0.0, -speed),
        label="large",
    )
    return Setting(scene, seconds)


def mat(young: float, density: float = 1000.0):
    """A mat of 1 by 1 and its material."""
    return wc.box((1.0, 1.0, 0.1), (6, 6, 1)), soft(young, density)


def board(soft_on_top: bool, seconds: float) -> Setting:
    """Two mats on the ground, one of them 10^4 times as stiff."""
    scene = wc.Scene(DOWN, friction=0.1)
    scene.add_plane(UP)
    kinds = (1e8, 2000.0), (1e4, 1000.0)
    for k, kind in enumerate(kinds if soft_on_top else kinds[::-1]):
        scene.add_body(*mat(*kind), (0.03 * k, 0.0, 0.051 + 0.103 * k))
    return Setting(scene, seconds)


def pulled(seconds: float) -> Setting:
    """A stiff ball lies on a mat whose ends are pulled apart by 0.28."""
    scene = wc.Scene(DOWN, friction=0.3)
    mesh, material = mat(1e6)
    ends = np.abs(mesh.vertices[:, 0]) > 0.49
    scene.add_body(mesh, material, fixed=ends, label="mat")
    scene.add_body(wc.sphere(0.2, 55), soft(1e8, 2000.0), (0.0, 0.0, 0.255), label="ball")
    side = np.sign(mesh.vertices[ends, :1]) * [1.0, 0.0, 0.0]

    def drive(sim: wc.Simulation) -> None:
        speed = 0.14 if sim.time < 1.0 else 0.0
        sim.set_velocity(0, speed * side, np.flatnonzero(ends))

    return Setting(scene, seconds, pairs=((0, 1, UP),), drive=drive)


def mats(young: float, seconds: float) -> Setting:
    """A mat falls on another one that is held at its base."""
    scene = wc.Scene(DOWN, friction=0.3)
    mesh, material = mat(1e4)
    scene.add_body(mesh, material, fixed=mesh.vertices[:, 2] < 0.0)
    scene.add_body(*mat(young), (0.03, 0.02, 0.105))
    return Setting(scene, seconds, pairs=((0, 1, UP),))


def column(density: float, young: float, seconds: float) -> Setting:
    """A cube on one that is held; the lower one is strained by 5 % at rest, by the heavier one."""
    scene = wc.Scene(DOWN, friction=0.3)
    edge = 0.1
    base = 20.0 * max(density, 1.0) * 1000.0 * 9.81 * edge * max(1.0, 1.0 / young)
    low = wc.box(edge, 2)
    held = low.vertices[:, 2] < -0.049
    scene.add_body(low, soft(base), fixed=held, label="low")
    high = soft(base * young, 1000.0 * density)
    scene.add_body(wc.box(edge, 3), high, (0.004, 0.003, edge + 1e-3), label="high")
    return Setting(scene, seconds, pairs=((0, 1, UP),))
