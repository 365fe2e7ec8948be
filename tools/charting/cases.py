"""Panels with a closed form: series springs, Hertz, free collision, mass ladder.

Every body is neo-Hookean, so that the engines that know no other law simulate the same. What is
held moves in from outside, because most engines cannot start from bodies inside each other. The
material damps stiffness-proportionally where the state of rest is asked for, with the same
coefficient for all.
"""

from functools import cache

import numpy as np
from verification import collision, hertz, weight
from verification.setup import G, on_face

import warp_contact as wc
from charting import panel as parts
from charting.laws import STEPS, squeeze
from charting.panel import Failed, Motion, Panel

LAST = 0.1  # part of the frames at the end over which a state of rest is averaged


def rest_frames(panel: Panel) -> slice:
    """The frames at the end."""
    return slice(-max(2, round(LAST * panel.frames)), None)


# A1: the upper column, ten times stiffer, is pushed onto the lower one; exact is where two bars of
# the engine's own law carry the same pressure.

SOFT, STIFF, OVERLAP, SPACE = 1e5, 1e6, 0.1, 0.02  # [Pa], [Pa], [m], [m]
PUSH, SETTLE = 0.3, 1.0  # [s]
ZETA = 0.35  # damping ratio of the slowest mode
SPEED = 10.0  # of the waves in both columns [m/s]
CELLS, QUICK_CELLS = ((3, 3, 6), (4, 4, 6)), ((2, 2, 4), (3, 3, 4))


@cache
def springs(quick: bool) -> Panel:
    """A1."""
    fps = 60
    push = round(PUSH * fps)
    across = QUICK_CELLS if quick else CELLS

    def build() -> wc.Scene:
        beta = 2.0 * ZETA / (0.5 * np.pi * SPEED)
        scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
        for k, (young, cells) in enumerate(zip((SOFT, STIFF), across, strict=True)):
            mesh = wc.box(1.0, cells)
            rubber = wc.NeoHookean(young, 0.0, young / SPEED**2, beta)
            place = (0.0, 0.0, 0.5 + k * (1.0 + SPACE))
            down = (0.0, 0.0, -k * (OVERLAP + SPACE) * fps / push)
            held = on_face(mesh, 2, 2 * k - 1)
            v = np.where(held[:, None], down, 0.0)
            scene.add_body(mesh, rubber, place, velocity=v, fixed=held)
        return scene

    frames = push + round(SETTLE * fps)
    title = "A1 series springs 1:10\nplace of the surface [of the overlap]"
    return Panel("A1", title, build, fps, frames, place, SOFT / 16.0, stop=push)


def place(panel: Panel, motion: Motion) -> float:
    """How far the mean heights of both faces are off, the worse of the two [of the overlap]."""
    parts.sound(panel, motion)
    scene = panel.scene()
    exact = meeting(motion.law)
    worst = 0.0
    for k, body in enumerate(scene.bodies):
        face = on_face(body.mesh, 2, 1 - 2 * k)
        z = motion.x[rest_frames(panel), parts.part(scene, k), 2][:, face]
        worst = max(worst, abs(float(z.mean()) - exact) / OVERLAP)
    return worst


@cache
def meeting(law: str) -> float:
    """Height at which both columns carry the same pressure [m]."""
    soft, stiff = (body.material.lame() for body in springs(True).scene().bodies)
    p = 0.0
    for _ in range(STEPS):
        gap = 2.0 - OVERLAP - squeeze(p, *soft, law) - squeeze(p, *stiff, law)
        p -= gap / (1.0 / SOFT + 1.0 / STIFF)
    return squeeze(p, *soft, law)


# A3: the cap of a sphere pressed onto a plane by a given depth.

FINE, QUICK_FINE = 2, 1  # elements across the radius of contact
HERTZ_PUSH, HERTZ_SETTLE = 0.01, 0.015  # [s]
HERTZ_FPS = 1000
HERTZ_SPACE = 1e-4  # at the start [m]


@cache
def pressed(quick: bool) -> Panel:
    """A3."""
    n = QUICK_FINE if quick else FINE
    a = hertz.contact_radius(hertz.LOADS[1], hertz.RADIUS, hertz.modulus(hertz.YOUNG))
    depth = a**2 / hertz.RADIUS
    push = round(HERTZ_PUSH * HERTZ_FPS)

    def build() -> wc.Scene:
        scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
        scene.add_plane((0.0, 0.0, 1.0), 0.0)
        mesh = hertz.cap(hertz.RADIUS, a / n, hertz.RINGS[n])
        omega = 0.5 * np.pi * hertz.pressure_wave(hertz.YOUNG) / hertz.HEIGHT
        rubber = wc.NeoHookean(hertz.YOUNG, hertz.POISSON, hertz.DENSITY, 2.0 * ZETA / omega)
        held = mesh.vertices[:, 2] > 0.999 * hertz.HEIGHT
        down = (0.0, 0.0, -(depth + HERTZ_SPACE) * HERTZ_FPS / push)
        v = np.where(held[:, None], down, 0.0)
        scene.add_body(mesh, rubber, (0.0, 0.0, HERTZ_SPACE), velocity=v, fixed=held)
        return scene

    frames = push + round(HERTZ_SETTLE * HERTZ_FPS)
    title = f"A3 Hertz, {n} element(s) across\npressure at the middle [of exact]"
    stiffness = hertz.YOUNG * a / n
    return Panel("A3", title, build, HERTZ_FPS, frames, peak, stiffness, stop=push)


def peak(panel: Panel, motion: Motion) -> float:
    """Pressure at the middle against Hertz at the imposed depth.

    At rest contact balances the internal forces, so the pressure follows from positions. The held
    plane above makes the body stiffer, and the mesh has its error too: whoever comes to rest on it
    meets at that floor, not at zero.
    """
    parts.sound(panel, motion)
    scene = panel.scene()
    body = scene.bodies[0]
    solid = parts.elastic(scene, motion.law)
    force = np.mean([solid.forces(x) for x in motion.x[rest_frames(panel)]], axis=0)
    under = hertz.on_ball(body)
    lowest = np.flatnonzero(under)[np.hypot(*body.mesh.vertices[under, :2].T).argmin()]
    p = -force[lowest, 2] / areas(body.mesh)[lowest]
    e_star = hertz.modulus(hertz.YOUNG)
    a = hertz.contact_radius(hertz.LOADS[1], hertz.RADIUS, e_star)
    p0 = 2.0 * e_star * a / (np.pi * hertz.RADIUS)
    return abs(float(p) / p0 - 1.0)


def areas(mesh: wc.TetMesh) -> np.ndarray:
    """A third of the surface around each vertex [m^2]."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.surface], 1, 0)
    third = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    return np.bincount(mesh.surface.ravel(), np.repeat(third, 3), minlength=len(mesh.vertices))


# A6: two undamped free blocks, the second ten times as dense, meet head-on.

DENSER = 10.0
FREE_FPS, FREE_TIME = 240, 0.25  # [1/s], [s]


@cache
def free(quick: bool) -> Panel:
    """A6: momentum, and with it energy."""

    def build() -> wc.Scene:
        return collision.thrown((3, 5), "head-on", DENSER)

    frames = round(FREE_TIME * FREE_FPS)
    title = "A6 free collision 1:10\n{} [of that at the start]"
    settings = build, FREE_FPS, frames
    second = Panel("A6e", title.format("energy gained or lost"), *settings, work, 500.0)
    title = title.format("change of momentum")
    return Panel("A6p", title, *settings, drift, 500.0, also=(second,))


def drift(panel: Panel, motion: Motion) -> float:
    """Largest change of momentum after any frame, of sum m |v| at the start."""
    met(panel, motion)
    m = parts.masses(panel.scene())
    p = np.einsum("i,fij->fj", m, motion.v.astype(float))
    scale = m @ np.linalg.norm(motion.v[0], axis=1)
    return float(np.linalg.norm(p - p[0], axis=1).max() / scale)


def work(panel: Panel, motion: Motion) -> float:
    """Change of kinetic and elastic energy, averaged over the end: integrators lag by half a step.

    Undamped and without friction exact is none; a loss counts as well as a gain.
    """
    met(panel, motion)
    solid, m = parts.elastic(panel.scene(), motion.law), parts.masses(panel.scene())

    def energy(k: int) -> float:
        return 0.5 * m @ (motion.v[k].astype(float) ** 2).sum(axis=1) + solid.energy(motion.x[k])

    late = range(panel.frames + 1 - panel.frames // 3, panel.frames + 1)
    return abs(float(np.mean([energy(k) for k in late])) / energy(0) - 1.0)


def met(panel: Panel, motion: Motion) -> None:
    """Raise ``Failed`` unless the blocks have met and parted."""
    parts.sound(panel, motion)
    scene = panel.scene()
    speed = [motion.v[:, parts.part(scene, k), 2].mean(axis=1) for k in range(2)]
    if not speed[1][-1] - speed[0][-1] > 0.0:
        raise Failed("the blocks do not part")


# A7m: a light cube carries one a hundred times as dense; they start where linear bars would rest,
# and their damping takes 1.25 s until less than 0.01 % of the weight is left of that error.

RATIO = 100.0
EDGE, LIGHT = weight.EDGE, weight.DENSITY  # [m], [kg/m^3]
LADDER_CELLS = 2, 3
LADDER_FPS, LADDER_TIME = 240, 1.5  # [1/s], [s]
LADDER_ZETA = 0.1  # a small part of the rate at which the light cube alone would be damped


@cache
def ladder(quick: bool) -> Panel:
    """A7m."""
    young = 20.0 * RATIO * LIGHT * G * EDGE  # 5 % of strain

    def build() -> wc.Scene:
        omega = np.sqrt(young / (RATIO * LIGHT)) / EDGE
        scene = wc.Scene(gravity=(0.0, 0.0, -G), friction=0.3)
        for k, density in enumerate((LIGHT, RATIO * LIGHT)):
            mesh = wc.box(EDGE, LADDER_CELLS[k])
            rubber = wc.NeoHookean(young, 0.0, density, 2.0 * LADDER_ZETA / omega)
            place = (0.0, 0.0, k * (EDGE + weight.APART))
            held = None if k else on_face(mesh, 2, -1)
            scene.add_body(mesh, rubber, place, fixed=held)
        return scene

    def start(scene: wc.Scene) -> np.ndarray:
        return np.concatenate(weight.cubes(RATIO, young).static(scene))

    frames = round(LADDER_TIME * LADDER_FPS)
    title = f"A7m heavy on light 1:{RATIO:g}\nforce and its ripple [of the weight]"
    stiffness = 0.1 * young * EDGE
    return Panel("A7m", title, build, LADDER_FPS, frames, carried, stiffness, start=start)


def carried(panel: Panel, motion: Motion) -> float:
    """Root mean square over the end of what is off in the force on the light cube.

    The force is what its stresses hand to its held base, less its own weight.
    """
    parts.sound(panel, motion)
    scene = panel.scene()
    solid, m = parts.elastic(scene, motion.law), parts.masses(scene)
    light, heavy = parts.part(scene, 0), parts.part(scene, 1)
    base = scene.bodies[0].fixed
    own = m[light][~base].sum() * G
    off = []
    for x in motion.x[rest_frames(panel)]:
        force = -solid.forces(x)[light][base, 2].sum() - own
        off.append(force / (m[heavy].sum() * G) - 1.0)
    return float(np.sqrt(np.mean(np.square(off))))
