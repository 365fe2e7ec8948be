"""B11: input on the border of what the method can do; what has no meaning: tests/scene."""

from collections.abc import Iterator

import numpy as np

import warp_contact as wc
from trials.outcome import BEYOND, FINE
from trials.pieces import UPSIDE_DOWN, tip
from trials.setting import DOWN, NONE, UP, Case, Setting, body, case, setting, soft

EDGE = 0.1  # [m]


def cases() -> Iterator[Case]:
    """What runs; where it is beyond the method, a refusal says why."""
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
    for far in (10.0, 100.0, 250.0, 1e3, 1e5, 1e7):
        expect = FINE if far < 293.0 else BEYOND  # 5000 edges
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


def pair(
    gap: float = 1e-3,
    aside: float = 0.0,
    far: float = 0.0,
    scale: float = 1.0,
    v: float = 0.5,
    gravity=DOWN,
    friction: float = 0.3,
    fixed: bool | str = "base",
    **material,
) -> Setting:
    """A cube comes down on one that is held; lengths, speed and time scale together."""
    rubber = soft(**{"poisson": 0.3} | material)
    at = np.array([far, 0.0, 0.0])
    place = at + scale * np.array([aside, aside, EDGE + gap])
    low = body(wc.box(scale * EDGE, 2), rubber, at, fixed=fixed, label="low")
    held = True if fixed is True else None
    high = body(wc.box(scale * EDGE, 2), rubber, place, v=-v, fixed=held, label="high")
    period = scale * 2.0 * EDGE * np.sqrt(rubber.density / rubber.youngs_modulus)
    run = {"seconds": 8.0 * period, "fps": 5.0 / period}
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
