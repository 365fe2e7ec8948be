"""B11: input on the border of what has a meaning: it runs, or is refused before the first step."""

from collections.abc import Iterator

import numpy as np

import warp_contact as wc
from trials.outcome import BEYOND, FINE, REFUSED
from trials.pieces import UPSIDE_DOWN, tip
from trials.setting import DOWN, NONE, UP, Case, Setting, body, case, setting, soft

EDGE = 0.1  # [m]


def cases() -> Iterator[Case]:
    """What has to run, then what has to be refused."""
    for name, aside in (("aligned", 0.0), ("shifted by half a cell", 0.25 * EDGE)):
        for gap in (0.0, -1e-12, -1e-6, 1e-6):
            yield case(f"B11 faces {name}, gap {gap:g}", pair, gap=gap, aside=aside)
    yield case("B11 corner exactly on a corner", pair, aside=EDGE)
    yield case("B11 vertex exactly on a face", on_tip)
    yield case("B11 vertex exactly on an edge", on_tip, 0.25 * EDGE)
    yield case("B11 vertex exactly on a vertex", on_tip, cells=2)
    yield case("B11 equal bodies in one place", pair, gap=-EDGE, expect=BEYOND)
    yield case("B11 sliver tet of aspect 1000", sliver, 1e3)
    yield case("B11 sliver tet of aspect 1e+06", sliver, 1e6, expect=BEYOND)
    yield case("B11 inverted tets at the start", pulled_through)
    for far in (1e1, 1e2, 1e3, 1e5, 1e7):
        expect = FINE if far < 2e3 else BEYOND
        yield case(f"B11 {far:g} m from the origin", pair, far=far, expect=expect)
    for scale in (1e-3, 1.0, 1e3):
        yield case(f"B11 lengths times {scale:g}", pair, scale=scale)
    for young in (1e2, 1e6, 1e9, 1e12):
        yield case(f"B11 E {young:g}", pair, young=young, v=5e-4 * young**0.5, gravity=NONE)
    for density in (1e-2, 1e5):
        yield case(f"B11 density {density:g}", pair, density=density, young=100 * density)
    for poisson in (0.0, 0.49, 0.499):
        yield case(f"B11 Poisson ratio {poisson:g}", pair, poisson=poisson)
    for friction in (0.0, 1.0, 10.0):
        yield case(f"B11 friction {friction:g}", pair, friction=friction)
    yield case("B11 gravity 0, at rest", pair, v=0.0, gravity=NONE)
    yield case("B11 all vertices fixed", pair, v=0.0, fixed=True)
    yield from refusals()


def refusals() -> Iterator[Case]:
    """What has to be refused, with a word on what is wrong where."""
    x, tets = wc.box(EDGE, 1).vertices, wc.box(EDGE, 1).tets
    eight, fine = np.arange(8)[:, None], wc.box(EDGE, 2)
    middle = np.abs(fine.vertices).max(axis=1, keepdims=True) < 1e-9
    meshes = {
        "NaN in a vertex": (np.where(eight == 3, np.nan, x), tets),
        "duplicate vertices, a flat tet": (np.where(eight == 7, x[6], x), tets),
        "zero-area triangles": (x * [1.0, 1.0, 0.0], tets),
        "a vertex of no tet": (np.concatenate([x, [[1.0, 1.0, 1.0]]]), tets),
        "a tet that repeats a vertex": (x, np.concatenate([tets, [[0, 1, 1, 2]]])),
        "a tet twice": (x, np.concatenate([tets, tets[:1]])),
        "an index out of range": (x, np.concatenate([tets, [[0, 1, 2, 99]]])),
        "no tets": (x, tets[:0]),
        "inverted tets in the rest shape": (fine.vertices + middle * [0.0, 0.0, EDGE], fine.tets),
        "a tet of aspect 1e8": (tip().vertices * [1.0, 1.0, 1e-8], [[0, 1, 2, 3]]),
    }
    for name, mesh in meshes.items():
        yield case(f"B11 {name}", alone, mesh, expect=REFUSED)
    yield case("B11 no bodies", setting, seconds=0.1, expect=REFUSED)
    given = {
        "fps 0": {"fps": 0.0},
        "fps infinite: a step of 0": {"fps": np.inf},
        "NaN in a velocity": {"v": np.nan},
        "NaN in gravity": {"gravity": (0.0, 0.0, np.nan)},
        "Poisson ratio 0.5": {"poisson": 0.5},
        "density 0": {"density": 0.0},
        "E 0": {"young": 0.0},
    }
    for name, argument in given.items():
        yield case(f"B11 {name}", pair, **argument, expect=REFUSED)


def pair(
    gap: float = 1e-3,
    aside: float = 0.0,
    far: float = 0.0,
    scale: float = 1.0,
    v: float = 0.5,
    gravity=DOWN,
    friction: float = 0.3,
    fixed: bool | str = "base",
    fps: float | None = None,
    **material,
) -> Setting:
    """A cube comes down on one that is held; lengths, speed and time scale together."""
    rubber = soft(**{"poisson": 0.3} | material)
    at = np.array([far, 0.0, 0.0])
    place = at + scale * np.array([aside, aside, EDGE + gap])
    low = body(wc.box(scale * EDGE, 2), rubber, at, fixed=fixed, label="low")
    held = True if fixed is True else None
    high = body(wc.box(scale * EDGE, 2), rubber, place, v=-v, fixed=held, label="high")
    period = scale
    if rubber.youngs_modulus > 0.0 and rubber.density > 0.0:
        period *= 2.0 * EDGE * np.sqrt(rubber.density / rubber.youngs_modulus)
    run = {"seconds": 8.0 * period, "fps": 5.0 / period if fps is None else fps}
    return setting(low, high, gravity=np.array(gravity) / scale, friction=friction, **run)


def on_tip(aside: float = 0.0, cells: int = 1) -> Setting:
    """A tet stands on its tip on a face, an edge or a vertex of a block, at distance zero."""
    low = body(wc.box(EDGE, cells), at=-0.5 * EDGE, fixed="base")
    place = 0.5 * EDGE - aside if aside else 0.0, 0.0, 0.0
    return setting(low, body(tip(EDGE), at=place, turn=UPSIDE_DOWN), seconds=0.15)


def sliver(aspect: float) -> Setting:
    """A flat tet falls on the ground; its step is as short as it is thin."""
    flat = body(tip(EDGE).scaled(1.0, 1.0, 1.0 / aspect), at=2.0 * EDGE / aspect)
    return setting(flat, planes=[UP], seconds=20.0 * EDGE / aspect, fps=100.0 * aspect)


def pulled_through() -> Setting:
    """A cube with some tets inside out: before the first step a corner moves through its middle."""

    def drive(sim: wc.Simulation) -> None:
        if sim.frame == 0:
            x = sim.positions(0)
            x[0] *= -0.6
            sim.state.x.assign(x)

    cube = body(wc.box(EDGE, 2), wc.NeoHookean(1e5, 0.4, 1000.0, 1e-3))
    return setting(cube, gravity=NONE, seconds=0.2, drive=drive)


def alone(mesh) -> Setting:
    """A body of these vertices and tets."""
    return setting(body(wc.TetMesh(*mesh)), seconds=0.1)
