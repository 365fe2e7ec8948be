"""A6: two free blocks collide; momentum, angular momentum and energy have to stay.

The blocks of ``tools/check.py``, here with unequal densities, obliquely and spinning, with friction
there, over a thousand steps. The scales are sum m |v| and sum m |x| |v| at the start.
"""

from collections.abc import Iterator

import numpy as np
from checks import collision as check

import warp_contact as wc
from verification.figure import Figure, zero
from verification.setup import Ask

STEPS = 1000  # at least
DURATION = 0.25  # at least [s]: until the blocks have parted
SPIN = 10.0  # [1/s]
SLIDE = 0.5  # sideways speed of an oblique impact [m/s]
FRICTION = 0.3  # of oblique and spinning ones
RATIOS = 1.0, 10.0, 1000.0  # of the densities
WAYS = "head-on", "oblique", "spinning"
# Momenta: 1e-7 is the random walk of float32 over a thousand steps.
MOMENTUM = 1e-4, 1e-6, 1e-7
RISE = 1e-2, 1e-3, 0.0  # of the energy: it may only fall


def run(ask: Ask) -> Iterator[Figure]:
    """Every way and ratio; the quick run takes coarser blocks."""
    for way in WAYS:
        for ratio in RATIOS:
            yield from collide(ask, (3, 5) if ask.quick else (5, 9), way, ratio)


def build(cells: tuple[int, int], way: str, ratio: float) -> wc.Scene:
    """Two blocks that meet along z, the second ``ratio`` times as dense."""
    friction = 0.0 if way == "head-on" else FRICTION
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    away = 0.5 * check.EDGE + check.GAP
    if way == "spinning":
        away *= np.sqrt(2.0)  # free of each other at any angle
    aside = 0.0 if way == "head-on" else 0.5 * SLIDE
    shift = np.zeros(3) if way == "head-on" else 0.5 * check.SHIFT
    for k, sign in enumerate((-1.0, 1.0)):
        mesh = wc.box(check.EDGE, cells[k])
        material = wc.NeoHookean(check.YOUNG, check.POISSON, check.DENSITY * ratio**k)
        v = np.tile(-sign * np.array([aside, 0.0, 0.5 * check.SPEED]), (len(mesh.vertices), 1))
        if way == "spinning":
            v += np.cross(sign * SPIN * np.array([0.6, 0.0, 0.8]), mesh.vertices)
        place = sign * (shift + [0.0, 0.0, away])
        scene.add_body(mesh, material, place, velocity=v, label=("first", "second")[k])
    return scene


def collide(ask: Ask, cells: tuple[int, int], way: str, ratio: float) -> Iterator[Figure]:
    """The worst after any frame."""
    label = f"A6 {way} {cells[0]}:{cells[1]} density 1:{ratio:g}"
    sim = wc.Simulation(build(cells, way, ratio), ask.respond(stiffness=500.0), fps=check.FPS)
    start, energy = check.Motion.of(sim), sim.measure().energy
    worst, overlap, steps, hit = np.zeros(3), 0.0, 0, False
    while steps < STEPS or sim.time < DURATION:
        sim.step_frame()
        steps += sim.substeps
        measured, now = sim.measure(), check.Motion.of(sim)
        hit = hit or measured.n_contacts > 0
        figures = (
            np.linalg.norm(now.p - start.p) / start.p_scale,
            np.linalg.norm(now.l - start.l) / start.l_scale,
            measured.energy / energy - 1.0,
        )
        worst = np.maximum(worst, figures)
        overlap = max(overlap, measured.overlap)
    if not hit:
        worst[:] = np.nan  # no figure of a collision
    edge = float(sim.model.body_edge.numpy().min())
    yield zero(label, "change of momentum [of sum m |v|]", worst[0], MOMENTUM)
    yield zero(label, "change of ang. momentum [of sum m |x| |v|]", worst[1], MOMENTUM)
    yield zero(label, "rise of the energy [of that at the start]", worst[2], RISE)
    yield zero(label, "deepest overlap [of an edge]", overlap / edge)
