"""Panels with a closed form: series springs, Hertz, free collision, mass ladder.

Every body is neo-Hookean, a law that all engines know. What is held moves in from outside, because
most engines cannot start from bodies inside each other. The material damps stiffness-proportionally
where the state of rest is asked for, with the same coefficient for all.
"""

from functools import partial

import numpy as np
from engines.task import Failed, Motion, Task
from measure.figure import rms
from verification import collision, hertz, weight
from verification.columns import Column, Pile
from verification.setup import G, on_face

import warp_contact as wc
from chart.panel import Elastic, Panel, late, sound

ZETA = 0.35  # damping ratio of the slowest mode, where bodies come to rest


def lower(scene: wc.Scene, way: float, frames: int, fps: float) -> wc.Scene:
    """The scene, with the held vertices of its last body on a way down [m] of so many frames."""
    body = scene.bodies[-1]
    body.v[body.fixed] = 0.0, 0.0, -way * fps / frames
    return scene


# A1: the upper column, ten times stiffer, is pushed onto the lower one; exact is where two bars of
# that law carry the same pressure, at a height for which there is a test.

SOFT, STIFF, OVERLAP, SPACE = 1e5, 1e6, 0.1, 0.02  # [Pa], [Pa], [m], [m]
MEETING = 0.9090045427235175  # height [m]
SPEED = 10.0  # of the waves in both columns [m/s]
PUSH, PUSH_FPS = 18, 60  # frames, [1/s]


def springs() -> wc.Scene:
    """Both columns."""
    columns = [
        Column(young, 1.0, young / SPEED**2, cells, damping=2.0 * ZETA / (0.5 * np.pi * SPEED))
        for young, cells in ((SOFT, (3, 3, 6)), (STIFF, (4, 4, 6)))
    ]
    scene = Pile(columns, SPACE, clamped=True).build(wc.NeoHookean)
    return lower(scene, OVERLAP + SPACE, PUSH, PUSH_FPS)


def place(task: Task, motion: Motion) -> float:
    """How far the mean heights of both faces are off, the worse of the two [of the overlap]."""
    parts, bodies = sound(task, motion).parts, task.scene().bodies
    faces = [on_face(body.mesh, 2, side) for body, side in zip(bodies, (1, -1), strict=True)]
    z = [motion.x[late(task), p, 2][:, face].mean() for p, face in zip(parts, faces, strict=True)]
    return float(np.abs(np.array(z, dtype=float) - MEETING).max() / OVERLAP)


# A3: the cap of a sphere pressed onto a plane by a given depth.

FINE = 2  # elements across the radius of contact
PRESS, PRESS_FPS = 10, 1000  # frames, [1/s]
SLIT = 1e-4  # at the start [m]


def ball() -> wc.Scene:
    """The cap above the plane."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    mesh = hertz.cap(hertz.RADIUS, hertz.CONTACT / FINE, hertz.RINGS[FINE])
    omega = 0.5 * np.pi * hertz.pressure_wave(hertz.YOUNG) / hertz.HEIGHT
    rubber = wc.NeoHookean(hertz.YOUNG, hertz.POISSON, hertz.DENSITY, 2.0 * ZETA / omega)
    held = mesh.vertices[:, 2] > 0.999 * hertz.HEIGHT
    scene.add_body(mesh, rubber, (0.0, 0.0, SLIT), fixed=held)
    return lower(scene, hertz.CONTACT**2 / hertz.RADIUS + SLIT, PRESS, PRESS_FPS)


def peak(task: Task, motion: Motion) -> float:
    """Pressure at the middle against Hertz at the imposed depth.

    At rest contact balances the internal forces, so the pressure follows from positions. The held
    plane above makes the body stiffer, and the mesh has its error too: whoever comes to rest on it
    meets at that floor, not at zero.
    """
    solid = sound(task, motion)
    body = task.scene().bodies[0]
    force = np.mean([solid.forces(x) for x in motion.x[late(task)]], axis=0)
    under = np.flatnonzero(hertz.on_ball(body))
    lowest = under[np.hypot(*body.mesh.vertices[under, :2].T).argmin()]
    around = body.mesh.surface[(body.mesh.surface == lowest).any(axis=1)]
    a, b, c = np.moveaxis(body.mesh.vertices[around], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 6.0  # a third of the triangles
    p0 = 2.0 * hertz.E_STAR * hertz.CONTACT / (np.pi * hertz.RADIUS)
    return abs(float(-force[lowest, 2] / area / p0) - 1.0)


# A6: two undamped free blocks, the second ten times as dense, meet head-on.


def drift(task: Task, motion: Motion) -> float:
    """Largest change of momentum after any frame, of sum m |v| at the start."""
    m = parted(task, motion).mass
    p = np.einsum("i,fij->fj", m, motion.v.astype(float))
    scale = m @ np.linalg.norm(motion.v[0], axis=1)
    return float(np.linalg.norm(p - p[0], axis=1).max() / scale)


def work(task: Task, motion: Motion) -> float:
    """Change of kinetic and elastic energy, averaged over the end: integrators lag by half a step.

    Undamped and without friction exact is none; a loss counts as well as a gain.
    """
    solid = parted(task, motion)
    energy = 0.5 * (motion.v.astype(float) ** 2).sum(axis=2) @ solid.mass
    energy += [solid.energy(x) for x in motion.x]
    return abs(float(energy[late(task, 1.0 / 3.0)].mean() / energy[0]) - 1.0)


def parted(task: Task, motion: Motion) -> Elastic:
    """As ``sound``; ``Failed`` as well unless the blocks have met and parted."""
    solid = sound(task, motion)
    first, second = (motion.v[-1, part, 2].mean() for part in solid.parts)
    if not second - first > 0.0:
        raise Failed("the blocks do not part")
    return solid


# A7m: a light cube carries one a hundred times as dense; they start where linear bars would rest,
# and their damping takes 1.25 s until less than 0.01 % of the weight is left of that error.

RATIO = 100.0
HEAVY = RATIO * weight.DENSITY  # [kg/m^3]
STIFFNESS = 20.0 * HEAVY * G * weight.EDGE  # 5 % of strain [Pa]
OMEGA = np.sqrt(STIFFNESS / HEAVY) / weight.EDGE
# The damping ratio is a small part of the rate at which the light cube alone would be damped.
CUBES = weight.cubes(RATIO, STIFFNESS, 2.0 * 0.1 / OMEGA)


def resting(scene: wc.Scene) -> np.ndarray:
    """Where linear bars rest [m]."""
    return np.concatenate(CUBES.static(scene))


def carried(task: Task, motion: Motion) -> float:
    """Root mean square over the end of what is off in the force on the light cube.

    The force is what its stresses hand to its held base, less its own weight.
    """
    solid = sound(task, motion)
    light, heavy = solid.parts
    base = task.scene().bodies[0].fixed
    own, load = solid.mass[light][~base].sum() * G, solid.mass[heavy].sum() * G
    forces = [-solid.forces(x)[light][base, 2].sum() - own for x in motion.x[late(task)]]
    return rms(np.array(forces) / load - 1.0)


COLLISION = "A6 free collision 1:10\n{} [of that at the start]"
TASKS = {  # and their panels
    "A1": (
        Task(springs, PUSH_FPS, PUSH + 60, SOFT / 16.0, stop=PUSH),
        [Panel("A1", "A1 series springs 1:10\nplace of the surface [of the overlap]", place)],
    ),
    "A3": (
        Task(ball, PRESS_FPS, PRESS + 15, hertz.YOUNG * hertz.CONTACT / FINE, stop=PRESS),
        [Panel("A3", "A3 Hertz, 2 element(s) across\npressure at the middle [of exact]", peak)],
    ),
    "A6": (
        Task(partial(collision.thrown, (3, 5), "head-on", 10.0), 240, 60, 500.0),
        [
            Panel("A6p", COLLISION.format("change of momentum"), drift),
            Panel("A6e", COLLISION.format("energy gained or lost"), work),
        ],
    ),
    "A7m": (
        Task(
            partial(CUBES.build, wc.NeoHookean),
            240,
            360,
            0.1 * STIFFNESS * weight.EDGE,
            start=resting,
        ),
        [Panel("A7m", "A7m heavy on light 1:100\nforce and its ripple [of the weight]", carried)],
    ),
}
