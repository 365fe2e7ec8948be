"""A3: Hertz: a sphere pressed onto a plane and onto another one, a long cylinder onto a plane.

    a = (3 F R / 4 E*)^(1/3),  d = a^2 / R,  p0 = 3 F / 2 pi a^2,  p = p0 sqrt(1 - r^2 / a^2)
    b = sqrt(4 F' R / pi E*),  p0 = sqrt(F' E* / pi R),  p = p0 sqrt(1 - x^2 / b^2)
    1 / E* = sum (1 - nu^2) / E,  1 / R = sum 1 / R_i,  F' the force per length of line

(Hertz 1882; Johnson 1985, Contact Mechanics, ch. 4.) The body is the lower part of a ball or of a
slice of a cylinder, held at a plane above, with N elements across a or b. Pressures are compared at
the force that is measured, so that the distance of the held plane, some 7 a, enters to the third
order only. The second moment of p gives a^2 = 5 / 2 sum F_i r_i^2 / F, b^2 = 4 sum F_i x_i^2 / F.

The Poisson ratio of the slice is 0, so that plane strain needs no force on its ends and is exact
with the ends free; its modulus is the E* of a ratio of 0.3, which is all that the pressures see.
They are those of rows of vertices along the line: force over the width of a row.
"""

import numpy as np
from measure.figure import Figure, Figures, relative, zero

import warp_contact as wc
from verification.setup import ALIGNED, Pose, rest, step_rate
from warp_contact.measure.contact_fields import vertex_area
from warp_contact.scene import shapes

RADIUS, YOUNG, POISSON, DENSITY = 0.1, 1e6, 0.3, 1000.0  # [m], [Pa], [-], [kg/m^3]
WIDTH, HEIGHT = 0.045, 0.06  # of the part of the ball [m]
LOAD, LOAD_BETWEEN = 10.0, 5.0  # on a plane, about; between spheres [N]
COUNTS = 1, 2, 4  # N
RINGS = {1: 6, 2: 8, 4: 12}  # of the mesh, for each N; 3/4 as many layers
SETTLE = 8.0  # 1 / (slowest frequency)
LINE_LOAD = 100.0  # about F' [N/m]
SLICE_WIDTH, SLICE_HEIGHT = 0.06, 0.08  # half the width and the height of the slice [m]
ACROSS = 2  # cells along the line
COLUMNS = {1: 8, 2: 10, 4: 14}  # from the middle to a side, for each N; as many layers
FIT = 0.92  # of b: the N elements end there

# About errors of linear triangles with an exact active set, plane strain: twice that, it, half.
PEAK = {1: (0.398, 0.199, 0.0995), 2: (0.256, 0.128, 0.064), 4: (0.182, 0.091, 0.0455)}
PROFILE = {1: (0.446, 0.223, 0.1115), 2: (0.224, 0.112, 0.056), 4: (0.178, 0.089, 0.0445)}
RADIUS_LIMITS = 0.1, 0.03, 0.01
OVERALL = "pressure, L2 error"  # name of the figure


def modulus(*youngs: float) -> float:
    """E* [Pa]; a single body is on something rigid."""
    return 1.0 / sum((1.0 - POISSON**2) / e for e in youngs)


def contact_radius(force: float, radius: float, e_star: float) -> float:
    """Exact a [m]."""
    return float(np.cbrt(0.75 * force * radius / e_star))


def line_contact(load: float, radius: float, e_star: float) -> tuple[float, float]:
    """Exact b [m] and p0 [Pa] at the force per length ``load`` [N/m]."""
    b = np.sqrt(4.0 * load * radius / (np.pi * e_star))
    return float(b), float(np.sqrt(load * e_star / (np.pi * radius)))


E_STAR, ORIGIN = modulus(YOUNG), (0.0, 0.0, 0.0)  # [Pa], [m]
CONTACT = contact_radius(LOAD, RADIUS, E_STAR)  # a that the meshes are made for [m]
Pressed = tuple[wc.Simulation, np.ndarray]  # at rest, mean pressures of the vertices [Pa]


def run(quick: bool) -> Figures:
    """A sphere on a plane, then on another one."""
    yield from planes(quick, on_plane)
    yield from on_sphere(2)


def cylinder(quick: bool) -> Figures:
    """A cylinder on a plane."""
    return planes(quick, line_on_plane)


def planes(quick: bool, on_plane) -> Figures:
    """1, 2 and 4 elements across; quick leaves 4 and the turned ones out."""
    for n in COUNTS[: 2 if quick else None]:
        for turned in (False,) if quick else (False, True):
            yield from on_plane(n, Pose(turned))


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


def pressure_wave(young: float, poisson: float = POISSON) -> float:
    """Speed of pressure waves [m/s]."""
    stiff = young * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    return float(np.sqrt(stiff / DENSITY))


def squeeze(bodies: list[tuple], size: float, depth=None, pose=ALIGNED) -> Pressed:
    """Let bodies come to rest that are held at their planes above.

    Each is a mesh with elements of ``size`` [m], a material, its place and rotation; with a depth
    [m] there is a plane below.
    """
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    if depth is not None:
        scene.add_plane(pose.out((0.0, 0.0, 1.0)), depth)
    for mesh, material, place, q in bodies:
        z = mesh.vertices[:, 2]
        scene.add_body(mesh, material, place, q, fixed=z > 0.999 * z.max())
    young, poisson = bodies[0][1].youngs_modulus, bodies[0][1].poisson_ratio
    speed = pressure_wave(young, poisson)
    sim = wc.Simulation(scene, fps=step_rate(size, speed))
    omega = 0.5 * np.pi * speed / bodies[0][0].vertices[:, 2].max()
    p = rest(sim, omega, SETTLE, lambda: sim.contact_fields()["pressure"].astype(float))
    return sim, p.mean(axis=0)


def press(n: float, depth: float, pose: Pose, rings: int | None = None) -> Pressed:
    """Press a sphere onto a plane by ``depth`` [m]."""
    ball = cap(RADIUS, CONTACT / n, rings or RINGS[n]), wc.Corotated(YOUNG, POISSON, DENSITY)
    return squeeze([(*ball, ORIGIN, pose.q)], CONTACT / n, depth, pose)


def on_plane(n: int, pose: Pose) -> Figures:
    """Force, radius, peak and profile of the pressure."""
    pressed = press(n, CONTACT**2 / RADIUS, pose)
    return below(f"A3 sphere on plane, N = {n} {pose.name}", pressed, RADIUS, E_STAR, n, pose)


def below(label: str, pressed: Pressed, radius: float, e_star: float, n: int, pose=ALIGNED):
    """The pressures below the first sphere, at the vertices of its lower side."""
    sim, p = pressed
    under = np.flatnonzero(on_ball(sim.scene.bodies[0]))
    r = np.linalg.norm(pose.back(sim.positions(0)[under])[:, :2], axis=1)
    p, area = p[under], vertex_area(sim.model, sim.state.x)[under]
    force = float(p @ area)
    yield Figure(label, "force [N]", force)
    a = contact_radius(force, radius, e_star)
    exact = a, 1.5 * force / (np.pi * a**2)
    yield from profile(label, "radius", r, p, area, exact, 2.5, n)


def profile(label: str, name: str, r, p, area, exact: tuple, moment: float, n: int) -> Figures:
    """Pressures [Pa] against p0 sqrt(1 - r^2 / a^2), with n elements across a of that name.

    Each is at a place ``r`` [m] for a part ``area`` of the surface; exact are a [m] and p0 [Pa] at
    the same force, and ``moment`` is a^2 over the second moment of p.
    """
    a, p0 = exact
    second = np.sqrt(moment * (p * area) @ r**2 / float(p @ area))
    yield relative(label, f"{name} from the second moment [m]", second, a, RADIUS_LIMITS)
    yield relative(label, "pressure at the middle [Pa]", p[np.abs(r).argmin()], p0, PEAK[n])
    shape = p0 * np.sqrt(np.maximum(1.0 - (r / a) ** 2, 0.0))
    yield zero(label, OVERALL, np.sqrt(area @ (p - shape) ** 2 / (area @ shape**2)), PROFILE[n])


def on_ball(body) -> np.ndarray:
    """Mask of the vertices of the lower side of a cap of ``RADIUS``."""
    x, y, z = body.mesh.vertices.T
    return np.abs(z + np.sqrt(RADIUS**2 - x**2 - y**2) - RADIUS) < 1e-9


def on_sphere(n: int) -> Figures:
    """Two equal caps, the upper one first, on meshes that do not match."""
    e_star, radius = modulus(YOUNG, YOUNG), 0.5 * RADIUS
    a = contact_radius(LOAD_BETWEEN, radius, e_star)
    mesh, material = cap(RADIUS, a / n, RINGS[n]), wc.Corotated(YOUNG, POISSON, DENSITY)
    half = np.radians(20.0) / 2.0  # the lower one upside down, turned by 20 degrees
    bodies = [
        (mesh, material, ORIGIN, ALIGNED.q),
        (mesh, material, (0.0, 0.0, a**2 / radius), (np.cos(half), np.sin(half), 0.0, 0.0)),
    ]
    return below(f"A3 two equal spheres, N = {n}", squeeze(bodies, a / n), radius, e_star, n)


def slab(size: float, columns: int) -> wc.TetMesh:
    """The slice about its lowest line, the y axis, with elements of ``size`` [m] there."""
    box = wc.box((2.0, ACROSS * size, 1.0), (2 * columns, ACROSS, columns))
    s, y, t = box.vertices.T
    x = SLICE_WIDTH * np.sign(s) * graded(np.abs(s), size / SLICE_WIDTH * columns)
    low = RADIUS - np.sqrt(RADIUS**2 - x**2)
    z = low + (SLICE_HEIGHT - low) * graded(t + 0.5, size / SLICE_HEIGHT * columns)
    return wc.TetMesh(np.stack([x, y, z], axis=1), box.tets)


def line_on_plane(n: int, pose: Pose) -> Figures:
    """Force, half-width, peak and profile of the pressure of rows of vertices along the line."""
    b, _ = line_contact(LINE_LOAD, RADIUS, E_STAR)
    # About the force asked for (Johnson 1985, sec. 5.6, nu = 0).
    depth = LINE_LOAD / (np.pi * E_STAR) * 2.0 * np.log(2.0 * SLICE_HEIGHT / b)
    mesh = slab(FIT * b / n, COLUMNS[n])
    material = wc.Corotated(E_STAR, 0.0, DENSITY)
    sim, p = squeeze([(mesh, material, ORIGIN, pose.q)], FIT * b / n, depth, pose)
    rest, row = np.unique(np.round(mesh.vertices[:, 0], 9), return_inverse=True)
    force = p * vertex_area(sim.model, sim.state.x)
    per_row, at = np.bincount(row, force), pose.back(sim.positions())[:, 0]
    x = np.bincount(row, at * force, len(rest)) / np.maximum(per_row, 1e-30)
    x = np.where(per_row > 0.0, x, rest)
    width = np.gradient(x)
    pressure = per_row / np.ptp(mesh.vertices[:, 1]) / width
    label, load = f"A3 cylinder on plane, N = {n} {pose.name}", float(pressure @ width)
    yield Figure(label, "force [N/m]", load)
    exact = line_contact(load, RADIUS, E_STAR)
    yield from profile(label, "half-width", x, pressure, width, exact, 4.0, n)
