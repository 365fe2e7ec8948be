"""A5: Coulomb friction, of a block on a plane.

    slope:  a = G (sin t - mu cos t) for mu < tan t, else none,  x = a t^2 / 2
    flat:   stops after t = v0 / mu G and d = v0^2 / 2 mu G, along v0
    while sliding |F| = N sqrt(1 + mu^2)

The slope of tan t = 1/2 is that of Li et al. (2020), "Incremental potential contact".
"""

import numpy as np
from measure.figure import Figures, relative, zero

import warp_contact as wc
from verification.setup import G, masses, watch

EDGE, DENSITY = 1.0, 1000.0  # [m], [kg/m^3]
YOUNG, POISSON = 1e8, 0.3  # [Pa], [-]: sinks by 0.01 % of its height
DAMPING = 1e-3  # [s]
CELLS = 2
GAP = 5e-4  # at the start [m]: a few resting gaps
FPS = 60
SLOPE, LASTS = 0.5, 2.5  # tan t, [s]
QUIET = 0.5  # [s] to come to rest before, and before a slope is measured
HOLD = 2.0  # friction until then
STICK = 0.51, 0.8
SLIDE = 0.0, 0.25, 0.45, 0.49
STOPS = (  # speed [m/s], mu, direction of the push in the plane [degrees]
    *((1.0, 0.1, 30.0), (2.0, 0.3, 30.0), (5.0, 0.8, 30.0), (0.5, 0.05, 30.0)),
    *((1.0, 0.1, 0.0), (1.0, 0.1, 17.0), (1.0, 0.1, 45.0)),
)

ACCELERATION = 0.05, 0.01, 0.001
NEAR = 0.2, 0.05, 0.01  # of the way at mu = 0.49: a difference of 2 % of the weight
CREEP = 1e-3, 1e-5, 0.0  # of an edge
ANGLE = 5.0, 1.0, 0.1  # [degrees]
CONE = 0.05, 0.01, 0.001
RIPPLE = 0.05, 0.005, 1e-5


def run(quick: bool) -> Figures:
    """Slopes, stops, directions; the quick run takes the first of most."""
    for mu in (*SLIDE[1:], STICK[0]) if quick else SLIDE + STICK:
        yield from slope(mu)
    for stopping in STOPS[: 2 if quick else None]:
        yield from stop(*stopping)


def build(tan: float, mu: float, velocity=(0.0, 0.0, 0.0)) -> wc.Scene:
    """A block on the plane z = 0; gravity leans so that x is downhill."""
    scene = wc.Scene(G * np.array([tan, 0.0, -1.0]) / np.hypot(tan, 1.0), mu)
    scene.add_plane((0.0, 0.0, 1.0))
    material = wc.NeoHookean(YOUNG, POISSON, DENSITY, DAMPING)
    scene.add_body(wc.box(EDGE, CELLS), material, (0.0, 0.0, 0.5 * EDGE + GAP), velocity=velocity)
    return scene


def begin(tan: float, mu: float, velocity=(0.0, 0.0, 0.0)) -> wc.Simulation:
    """A simulation that starts at rest against the plane, with its velocity.

    A deformable block that is let go starts to swing, which leaves it with a speed of its own. So
    it comes to rest first, held by a friction that no slope here overcomes.
    """
    at_rest = wc.Simulation(build(tan, HOLD), fps=FPS)
    watch(at_rest, QUIET)
    sim = wc.Simulation(build(tan, mu, velocity), fps=FPS)
    sim.state.x.assign(at_rest.positions())
    return sim


def centre(sim: wc.Simulation) -> np.ndarray:
    """Place [m] and velocity [m/s] of the centre of mass, shape (2, 3)."""
    m = masses(sim)
    return np.array([m @ a.astype(float) / m.sum() for a in (sim.positions(), sim.velocities())])


def slope(mu: float) -> Figures:
    """Acceleration, way and force of a block that slides down, creep of one that ought to stay."""
    label = f"A5 slope {SLOPE:g}, mu {mu:g}"
    sim = begin(SLOPE, mu)
    start = centre(sim)[0, 0]
    watch(sim, QUIET)
    first = sim.positions().astype(float)

    def look() -> tuple[float, ...]:
        return sim.time, centre(sim)[1, 0], sum(sim.measure().forces.values())

    time, v, force = watch(sim, LASTS - QUIET, look).T
    if mu > SLOPE:
        foot = first[:, 2] < 0.1 * EDGE
        way = np.linalg.norm((sim.positions() - first)[foot, :2], axis=1).max()
        yield zero(label, "creep of the foot in 2 s [of an edge]", way / EDGE, CREEP)
        return
    exact = G * (SLOPE - mu) / np.hypot(SLOPE, 1.0)
    yield relative(label, "acceleration [m/s^2]", np.polyfit(time, v, 1)[0], exact, ACCELERATION)
    way = centre(sim)[0, 0] - start
    limits = NEAR if SLOPE - mu < 0.05 * SLOPE else ACCELERATION
    yield relative(label, "way after 2.5 s [m]", way, 0.5 * exact * sim.time**2, limits)
    size = DENSITY * EDGE**3 * G * np.hypot(1.0, mu) / np.hypot(SLOPE, 1.0)
    yield relative(label, "mean contact force [N]", force.mean(), size, CONE)
    yield zero(label, "ripple of the force [of the mean]", force.std() / size, RIPPLE)


def stop(speed: float, mu: float, degrees: float) -> Figures:
    """Way, time and direction of a block that slides to a stop."""
    label = f"A5 flat, {speed:g} m/s, mu {mu:g}, {degrees:g} deg"
    way = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    sim = begin(0.0, mu, speed * way)
    start = centre(sim)[0]
    exact = speed / (mu * G)
    lasts = np.ceil((1.1 * exact + 0.1) * FPS) / FPS
    x, v = np.moveaxis(watch(sim, lasts, lambda: centre(sim)), 1, 0)
    moved = x[-1] - start
    yield relative(label, "way to the stop [m]", moved @ way, 0.5 * speed * exact, ACCELERATION)
    t = np.arange(1, len(v) + 1) / FPS
    sliding = (t > 0.2 * exact) & (t < 0.8 * exact)
    slope, at = np.polyfit(t[sliding], v[sliding] @ way, 1)
    yield relative(label, "time to the stop [s]", -at / slope, exact, ACCELERATION)
    side = np.degrees(np.arctan2(moved @ [-way[1], way[0], 0.0], moved @ way))
    yield zero(label, "direction [degrees]", side, ANGLE)
