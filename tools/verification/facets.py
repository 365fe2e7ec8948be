"""A9: a fine block slides over the facets of a coarse one without friction; nothing may be felt.

    F_n = W, F_t = 0, constant height

The claim of Spillmann and Teschner (2005) is a force that stays continuous while contacts change
from facet to facet. The coarse block is flat and fixed, so that the answer is exact. In the full
run it is deformable too; then the height depends on where the load is and is not judged.
"""

from collections.abc import Iterator

import numpy as np

import warp_contact as wc
from verification.figure import Figure, relative, rms, zero
from verification.setup import Ask, G

EDGE, CELLS, DENSITY = 0.1, 4, 1000.0  # of the block that slides [m], [kg/m^3]
YOUNG, POISSON, DAMPING = 1e5, 0.3, 2e-3  # [Pa], [-], [s]
RATIOS = 4.0, 1.37  # cells of the coarse block over those of the fine one
LENGTH, WIDTH = 0.4, 0.2  # of the coarse block, about [m]
SPEED = 0.1  # [m/s]
SETTLE, SAMPLE = 0.8, 1.2  # [s]: the slow cell of ratio 4 lasts 1 s
FPS = 60
PENALTY = 500.0, 1.0  # [N/m], [N s/m]

NORMAL = 0.1, 0.02, 0.001  # rms of the force, of W
ALONG = 0.05, 0.01, 0.001
HEIGHT = 1e-3, 1e-4, 1e-5  # rms, of an edge


def run(ask: Ask) -> Iterator[Figure]:
    """Both ratios, on a fixed and in the full run on a deformable block."""
    for ratio in RATIOS:
        for fixed in (True,) if ask.quick else (True, False):
            yield from drag(ask, ratio, fixed)


def build(ratio: float, fixed: bool) -> wc.Scene:
    """The fine block at one end of the coarse one, in motion."""
    scene = wc.Scene(gravity=(0.0, 0.0, -G), friction=0.0)
    cell = ratio * EDGE / CELLS
    cells = [round(LENGTH / cell), round(WIDTH / cell), 1]
    size = cell * np.array(cells)
    material = wc.NeoHookean(YOUNG, POISSON, DENSITY, DAMPING)
    base = wc.box(size, cells)
    held = True if fixed else base.vertices[:, 2] < 0.0
    scene.add_body(base, material, (0.0, 0.0, -0.5 * size[2]), fixed=held, label="base")
    gap = 1e-3 * EDGE / CELLS
    place = (0.5 * (EDGE - size[0]) + 0.013, 0.007, 0.5 * EDGE + gap)  # rims over no edge
    block = wc.box(EDGE, CELLS)
    scene.add_body(block, material, place, velocity=(SPEED, 0.0, 0.0), label="block")
    return scene


def drag(ask: Ask, ratio: float, fixed: bool) -> Iterator[Figure]:
    """Ripples of both forces and of the height."""
    label = f"A9 facets 1:{ratio:g}, {'fixed' if fixed else 'deformable'} base"
    sim = wc.Simulation(build(ratio, fixed), ask.respond(*PENALTY), fps=FPS)
    mass = sim.model.mass.numpy()[-len(sim.scene.bodies[1].x) :].astype(float)
    weight = mass.sum() * G
    for _ in sim.frames(round(SETTLE * FPS)):
        pass
    momentum = mass @ sim.velocities(1)[:, 0]
    normal, along, height = [], [], []
    for _ in sim.frames(round(SAMPLE * FPS)):
        normal.append(sim.measure().forces.get(("base", "block"), 0.0))
        before, momentum = momentum, mass @ sim.velocities(1)[:, 0]
        along.append((momentum - before) * FPS)
        height.append(mass @ sim.positions(1)[:, 2] / mass.sum())
    yield relative(label, "mean normal force [N]", np.mean(normal), weight, NORMAL)
    yield zero(label, "ripple of the normal force [of W]", np.std(normal) / weight, NORMAL)
    phase = 2j * np.pi * SPEED / (ratio * EDGE / CELLS) * np.arange(len(normal)) / FPS
    tone = 2.0 * abs(np.mean((np.array(normal) - np.mean(normal)) * np.exp(-phase)))
    yield zero(label, "its part at the frequency of the facets [of W]", tone / weight, NORMAL)
    yield zero(label, "rms of the force along [of W]", rms(along) / weight, ALONG)
    ripple = np.std(height) / EDGE
    yield zero(label, "ripple of the height [of an edge]", ripple, HEIGHT if fixed else ())
