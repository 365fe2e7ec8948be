"""A3: Hertz: a sphere pressed onto a rigid plane and onto another sphere.

    a = (3 F R / 4 E*)^(1/3),  d = a^2 / R,  p0 = 3 F / 2 pi a^2,  p = p0 sqrt(1 - r^2 / a^2)
    1 / E* = sum (1 - nu^2) / E,  1 / R = sum 1 / R_i

(Hertz 1882; Johnson 1985, Contact Mechanics, ch. 4.) The body is the lower part of a ball of radius
R, held at a plane above, with N elements across the radius of contact a. Pressures are compared at
the force that is measured, so that the distance of the held plane, some 7 a, enters to the third
order only. The second moment of p gives a^2 = 5 / 2 sum F_i r_i^2 / F.
"""

from collections.abc import Iterator

import numpy as np

import warp_contact as wc
from verification.figure import Figure, relative, zero
from verification.relax import relax, step_rate
from verification.setup import Ask, Pose
from verification.weight import vertex_areas
from warp_contact.scene import shapes

RADIUS, YOUNG, POISSON, DENSITY = 0.1, 1e6, 0.3, 1000.0  # [m], [Pa], [-], [kg/m^3]
WIDTH, HEIGHT = 0.045, 0.06  # of the part of the ball [m]
LOADS = 5.0, 10.0, 20.0  # of the depths that are imposed [N]
COUNTS = 1, 2, 4  # N
RINGS = {1: 6, 2: 8, 4: 12}  # of the mesh, for each N; 3/4 as many layers
SETTLE = 8.0  # 1 / (slowest frequency)
SAMPLE = 0.2  # part of the frames at the end that is averaged
PAIRS = {  # case: (radii [m], moduli [Pa], force [N])
    "two equal spheres": ((0.1, 0.1), (1e6, 1e6), 5.0),
    "soft on stiff sphere": ((0.1, 0.2), (1e6, 1e7), 5.0),
}

# Errors of linear triangles with an exact active set, plane strain: good is twice that, best half.
PEAK = {1: 0.199, 2: 0.128, 4: 0.091}
PROFILE = {1: 0.223, 2: 0.112, 4: 0.089}
RADIUS_LIMITS = 0.1, 0.03, 0.01
SLOPE = 0.1, 0.05, 0.01
OVERALL = "pressure, L2 error"  # name of the figure


def around(base: float) -> tuple[float, float, float]:
    """Limits about the error of the textbook method."""
    return 2.0 * base, base, 0.5 * base


def modulus(*youngs: float) -> float:
    """E* [Pa]; a single body is on something rigid."""
    return 1.0 / sum((1.0 - POISSON**2) / e for e in youngs)


def contact_radius(force: float, radius: float, e_star: float) -> float:
    """Exact a [m]."""
    return float(np.cbrt(0.75 * force * radius / e_star))


def run(ask: Ask) -> Iterator[Figure]:
    """A plane with 1, 2, 4 elements, the exponent of F(d), then pairs; quick leaves 4 out."""
    for n in COUNTS[: 2 if ask.quick else None]:
        for turned in (False,) if ask.quick else (False, True):
            yield from on_plane(ask, n, Pose(turned))
    yield from exponent(ask, 2)
    for name in list(PAIRS)[: 1 if ask.quick else None]:
        yield from on_sphere(ask, name, 2)


def cap(radius: float, size: float, rings: int) -> wc.TetMesh:
    """The part of a ball about its lowest point, the origin, with elements of ``size`` there.

    Radii and heights follow sinh(k s) / sinh(k), with k such that the first step is ``size``.
    """
    layers = max(3, round(0.75 * rings))
    rho, theta, zeta, tets = shapes.drum(rings, layers)
    r = WIDTH * graded(rho, size / WIDTH * rings)
    low = radius - np.sqrt(radius**2 - r**2)
    z = low + (HEIGHT - low) * graded(zeta, size / HEIGHT * layers)
    return wc.TetMesh(np.stack([r * np.cos(theta), r * np.sin(theta), z], axis=1), tets)


def graded(s: np.ndarray, slope: float) -> np.ndarray:
    """The map sinh(k s) / sinh(k) of 0..1, its slope at 0 as given (1 or more: no grading)."""
    low, high = 1e-6, 20.0
    for _ in range(60):
        k = 0.5 * (low + high)
        low, high = (k, high) if k / np.sinh(k) > slope else (low, k)
    return np.sinh(k * s) / np.sinh(k)


def on_plane(ask: Ask, n: int, pose: Pose) -> Iterator[Figure]:
    """Force, radius, peak and profile of the pressure."""
    label = f"A3 sphere on plane, N = {n} {pose}"
    a = contact_radius(LOADS[1], RADIUS, modulus(YOUNG))
    sim, p = press(ask, n, a**2 / RADIUS, a, pose)
    yield from profile(label, sim, p, RADIUS, modulus(YOUNG), n, pose)


def press(
    ask: Ask, n: float, depth: float, a: float, pose: Pose, rings: int | None = None
) -> tuple[wc.Simulation, np.ndarray]:
    """Press a sphere onto a plane by ``depth`` [m]; mean pressures of its vertices [Pa]."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    scene.add_plane(pose.out((0.0, 0.0, 1.0)), depth)
    mesh = cap(RADIUS, a / n, rings or RINGS[n])
    held = mesh.vertices[:, 2] > 0.999 * HEIGHT
    scene.add_body(mesh, wc.Corotated(YOUNG, POISSON, DENSITY), rotation=pose.q, fixed=held)
    respond = ask.respond(100.0 * YOUNG * a / n)
    sim = wc.Simulation(scene, respond, fps=rate(a / n, YOUNG))
    return sim, settle(sim, slowest(YOUNG))


def rate(size: float, young: float) -> float:
    """Frames per second for elements of ``size`` [m]."""
    return step_rate(size, pressure_wave(young))


def pressure_wave(young: float) -> float:
    """Speed of pressure waves [m/s]."""
    stiff = young * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))
    return float(np.sqrt(stiff / DENSITY))


def slowest(young: float) -> float:
    """Frequency of the slowest mode along the axis [1/s]."""
    return 0.5 * np.pi * pressure_wave(young) / HEIGHT


def settle(sim: wc.Simulation, omega: float) -> np.ndarray:
    """Let it come to rest, slowest mode ``omega`` [1/s]; mean pressures of the last frames [Pa]."""
    frames = int(np.ceil(SETTLE / omega * sim.fps))
    first = int((1.0 - SAMPLE) * frames)
    p = 0.0
    for frame in relax(sim, omega, frames):
        if frame > first:
            p = p + sim.contact_fields()["pressure"].astype(float) / (frames - first)
    return p


def profile(
    label: str, sim: wc.Simulation, p: np.ndarray, radius: float, e_star: float, n: int, pose: Pose
) -> Iterator[Figure]:
    """The first body's pressures against those of Hertz at the same force."""
    body = sim.scene.bodies[0]
    count = len(body.x)
    p, area = p[:count], vertex_areas(sim)[:count]
    r = np.linalg.norm(pose.back(sim.positions(body))[:, :2], axis=1)
    under = on_ball(body)
    p, area, r = p[under], area[under], r[under]
    force = float(p @ area)
    if force <= 0.0:
        yield zero(label, "force [N]", float("nan"), RADIUS_LIMITS)
        return
    a = contact_radius(force, radius, e_star)
    p0 = 1.5 * force / (np.pi * a**2)
    exact = p0 * np.sqrt(np.maximum(1.0 - (r / a) ** 2, 0.0))
    yield Figure(label, "force [N]", force)
    found = float(np.sqrt(2.5 * (p * area) @ r**2 / force))
    yield relative(label, "radius from the second moment [m]", found, a, RADIUS_LIMITS)
    yield relative(label, "pressure at the middle [Pa]", p[r.argmin()], p0, around(PEAK[n]))
    off = float(np.sqrt(area @ (p - exact) ** 2 / (area @ exact**2)))
    yield zero(label, OVERALL, off, around(PROFILE[n]))


def on_ball(body) -> np.ndarray:
    """Mask of the vertices of the lower side of a cap."""
    x = body.mesh.vertices
    r = np.hypot(x[:, 0], x[:, 1])
    height = x[:, 2] + np.sqrt(np.maximum(curvature(body) ** 2 - r**2, 0.0)) - curvature(body)
    return np.abs(height) < 1e-9


def curvature(body) -> float:
    """Radius of a cap from the height of its lower rim [m]."""
    x = body.mesh.vertices
    low = x[np.hypot(x[:, 0], x[:, 1]) > WIDTH - 1e-9, 2].min()
    return 0.5 * (WIDTH**2 + low**2) / low


def exponent(ask: Ask, n: int) -> Iterator[Figure]:
    """Slope of log F over log d; the held plane adds a part linear in F to d."""
    e_star = modulus(YOUNG)
    a = contact_radius(LOADS[1], RADIUS, e_star)
    depths, forces = [], []
    for load in LOADS:
        depths.append(contact_radius(load, RADIUS, e_star) ** 2 / RADIUS)
        sim, _ = press(ask, n, depths[-1], a, Pose())
        forces.append(sum(sim.measure().forces.values()))
    slope = float(np.polyfit(np.log(depths), np.log(forces), 1)[0])
    label = f"A3 sphere on plane, N = {n}"
    yield Figure(label, "exponent of F(d)", slope, 1.5, slope - 1.5, SLOPE)


def on_sphere(ask: Ask, name: str, n: int) -> Iterator[Figure]:
    """Two caps, the upper one first, on meshes that do not match."""
    radii, youngs, load = PAIRS[name]
    e_star, radius = modulus(*youngs), 1.0 / sum(1.0 / r for r in radii)
    a = contact_radius(load, radius, e_star)
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    half = np.radians(20.0) / 2.0  # the lower one upside down, turned by 20 degrees
    for k, q in enumerate(((0.0, 0.0, 0.0, 1.0), (np.cos(half), np.sin(half), 0.0, 0.0))):
        mesh = cap(radii[k], a / n, RINGS[n])
        held = mesh.vertices[:, 2] > 0.999 * HEIGHT
        # The stiffer one denser, for the same step.
        material = wc.Corotated(youngs[k], POISSON, DENSITY * youngs[k] / YOUNG)
        place = (0.0, 0.0, k * a**2 / radius)
        scene.add_body(mesh, material, place, q, fixed=held)
    respond = ask.respond(100.0 * YOUNG * a / n)
    sim = wc.Simulation(scene, respond, fps=rate(a / n, YOUNG))
    p = settle(sim, slowest(YOUNG))
    yield from profile(f"A3 {name}, N = {n}", sim, p, radius, e_star, n, Pose())
