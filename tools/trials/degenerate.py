"""B11: input on the border of what has a meaning: it runs, or is refused before the first step."""

from collections.abc import Iterator
from functools import partial

import numpy as np

import warp_contact as wc
from trials.case import DOWN, NONE, UP, Case, soft
from trials.outcome import BEYOND, FINE, REFUSED
from trials.pieces import UPSIDE_DOWN, tip
from trials.watch import Setting

EDGE = 0.1  # [m]


def cases(quick: bool) -> Iterator[Case]:
    """What has to run, then what has to be refused."""
    for name, aside in (("aligned", 0.0), ("shifted by half a cell", 0.25 * EDGE)):
        for gap in (0.0, -1e-12, -1e-6, 1e-6):
            yield Case(f"B11 faces {name}, gap {gap:g}", partial(pair, gap=gap, aside=aside))
    yield Case("B11 corner exactly on a corner", partial(pair, aside=EDGE))
    yield Case("B11 vertex exactly on a face", partial(on_tip, 0.0, 0.0))
    yield Case("B11 vertex exactly on an edge", partial(on_tip, 0.25 * EDGE, 0.0))
    yield Case("B11 vertex exactly on a vertex", partial(on_tip, 0.0, 0.0, 2))
    yield Case("B11 equal bodies in one place", partial(pair, gap=-EDGE), BEYOND)
    yield Case("B11 sliver tet of aspect 1000", partial(sliver, 1e3))
    yield Case("B11 sliver tet of aspect 1e+06", partial(sliver, 1e6), BEYOND)
    yield Case("B11 inverted tets at the start", pulled_through)
    for far in (1e1, 1e2, 1e3) if quick else (1e1, 1e2, 1e3, 1e5, 1e7):
        expect = FINE if far < 2e3 else BEYOND
        yield Case(f"B11 {far:g} m from the origin", partial(pair, far=far), expect)
    for scale in (1e-3, 1.0, 1e3):
        yield Case(f"B11 lengths times {scale:g}", partial(pair, scale=scale))
    for young in (1e2, 1e6, 1e9) if quick else (1e2, 1e6, 1e9, 1e12):
        yield Case(
            f"B11 E {young:g}", partial(pair, young=young, v=5e-4 * young**0.5, gravity=NONE)
        )
    for density in (1e-2, 1e5):
        yield Case(f"B11 density {density:g}", partial(pair, density=density, young=100 * density))
    for poisson in (0.0, 0.49, 0.499):
        yield Case(f"B11 Poisson ratio {poisson:g}", partial(pair, poisson=poisson))
    for friction in (0.0, 1.0, 10.0):
        yield Case(f"B11 friction {friction:g}", partial(pair, friction=friction))
    yield Case("B11 gravity 0, at rest", partial(pair, v=0.0, gravity=NONE))
    yield Case("B11 all vertices fixed", partial(pair, fixed=True))
    yield from refusals()


def refusals() -> Iterator[Case]:
    """What has to be refused, with a word on what is wrong where."""
    x, tets = wc.box(EDGE, 1).vertices, wc.box(EDGE, 1).tets
    twin = np.where(np.arange(8)[:, None] == 7, x[6], x)
    nan, flat = np.where(np.arange(8)[:, None] == 3, np.nan, x), x * [1.0, 1.0, 0.0]
    meshes = {
        "NaN in a vertex": (nan, tets),
        "duplicate vertices, a flat tet": (twin, tets),
        "zero-area triangles": (flat, tets),
        "a vertex of no tet": (np.concatenate([x, [[1.0, 1.0, 1.0]]]), tets),
        "a tet that repeats a vertex": (x, np.concatenate([tets, [[0, 1, 1, 2]]])),
        "a tet twice": (x, np.concatenate([tets, tets[:1]])),
        "an index out of range": (x, np.concatenate([tets, [[0, 1, 2, 99]]])),
        "no tets": (x, tets[:0]),
        "inverted tets in the rest shape": folded(),
        "a tet of aspect 1e8": (tip().vertices * [1.0, 1.0, 1e-8], [[0, 1, 2, 3]]),
    }
    for name, mesh in meshes.items():
        yield Case(f"B11 {name}", partial(body, mesh), REFUSED)
    yield Case("B11 no bodies", lambda: Setting(wc.Scene(), 0.1), REFUSED)
    yield Case("B11 fps 0", lambda: Setting(pair().scene, 0.1, fps=0.0), REFUSED)
    yield Case("B11 fps infinite: a step of 0", infinite_rate, REFUSED)
    yield Case("B11 NaN in a velocity", partial(pair, v=np.nan), REFUSED)
    yield Case("B11 NaN in gravity", partial(pair, gravity=(0.0, 0.0, np.nan)), REFUSED)
    yield Case("B11 Poisson ratio 0.5", partial(pair, poisson=0.5), REFUSED)
    yield Case("B11 density 0", partial(pair, density=0.0), REFUSED)
    yield Case("B11 E 0", partial(pair, young=0.0), REFUSED)


def pair(
    gap=1e-3,
    aside=0.0,
    far=0.0,
    scale=1.0,
    young=1e5,
    density=1000.0,
    poisson=0.3,
    friction=0.3,
    v=0.5,
    gravity=DOWN,
    fixed=None,
) -> Setting:
    """A cube comes down on one that is held; lengths, speed and time scale together."""
    g = np.array(gravity) * (1.0 if scale == 1.0 else 1.0 / scale)
    scene = wc.Scene(g, friction=friction)
    material = soft(young, density, poisson)
    low, high = (wc.box(scale * EDGE, 2) for _ in range(2))
    held = True if fixed else low.vertices[:, 2] < -0.49 * scale * EDGE
    at = np.array([far, 0.0, 0.0])
    scene.add_body(low, material, at, fixed=held, label="low")
    place = at + scale * np.array([aside, aside, EDGE + gap])
    scene.add_body(high, material, place, velocity=(0.0, 0.0, -v), fixed=fixed, label="high")
    if fixed:
        scene.bodies[1].v[:] = 0.0
    period = 2.0 * EDGE * np.sqrt(density / young) if young > 0.0 and density > 0.0 else 1.0
    return Setting(scene, 8.0 * scale * period, 5.0 / (scale * period), pairs=((0, 1, UP),))


def on_tip(aside: float, along: float, cells: int = 1) -> Setting:
    """A tet stands on its tip on a face, an edge or a vertex of a block, at distance zero."""
    scene = wc.Scene(DOWN, friction=0.3)
    low = wc.box(EDGE, cells)
    shift = 0.5 * EDGE - aside if aside else 0.0
    scene.add_body(low, soft(), (0.0, 0.0, -0.5 * EDGE), fixed=low.vertices[:, 2] < -0.049)
    scene.add_body(tip(EDGE), soft(), (shift if cells == 1 else 0.0, along, 0.0), UPSIDE_DOWN)
    return Setting(scene, 0.15, pairs=((0, 1, UP),))


def sliver(aspect: float) -> Setting:
    """A flat tet falls on the ground; its step is as short as it is thin."""
    scene = wc.Scene(DOWN, friction=0.3)
    scene.add_plane(UP)
    mesh = tip(EDGE).scaled(1.0, 1.0, 1.0 / aspect)
    scene.add_body(mesh, soft(), (0.0, 0.0, 2.0 * EDGE / aspect))
    return Setting(scene, 200.0 * EDGE / aspect / 10.0, 100.0 * aspect)


def pulled_through() -> Setting:
    """A cube with some tets inside out: before the first step a corner moves through its middle."""
    scene = wc.Scene(NONE)
    body = scene.add_body(wc.box(EDGE, 2), wc.NeoHookean(1e5, 0.4, 1000.0, 1e-3))

    def drive(sim: wc.Simulation) -> None:
        if sim.frame == 0:
            x = sim.positions(body)
            x[0] *= -0.6
            sim.state.x.assign(x)

    return Setting(scene, 0.2, drive=drive)


def folded():
    """A cube whose middle vertex lies outside of it: its tets overlap."""
    mesh = wc.box(EDGE, 2)
    middle = np.abs(mesh.vertices).max(axis=1) < 1e-9
    return mesh.vertices + np.where(middle[:, None], [0.0, 0.0, EDGE], 0.0), mesh.tets


def body(mesh) -> Setting:
    """A body of these vertices and tets."""
    scene = wc.Scene(DOWN)
    scene.add_body(wc.TetMesh(*mesh), soft())
    return Setting(scene, 0.1)


def infinite_rate() -> Setting:
    """Frames without an end."""
    setting = pair()
    setting.fps = float("inf")
    return setting
