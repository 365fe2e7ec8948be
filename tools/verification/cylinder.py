"""A3: Hertz: a long cylinder pressed onto a rigid plane, in plane strain.

    b = sqrt(4 F' R / pi E*),  p0 = sqrt(F' E* / pi R),  p = p0 sqrt(1 - x^2 / b^2)

(Hertz 1882; Johnson 1985, Contact Mechanics, ch. 4.) F' is the force per length of line. The body
is a slice of the lower part of the cylinder, held at a plane above, with N elements across b. Its
Poisson ratio is 0, so that plane strain needs no force on the ends of the slice and is exact with
the ends free; its modulus is the E* of a ratio of 0.3, which is all that the pressures see. They
are compared at the force that is measured, by rows of vertices along the line: force over the width
of a row. The second moment of p gives b^2 = 4 sum F_i x_i^2 / F.
"""

from collections.abc import Iterator

import numpy as np
from measure.figure import Figure

import warp_contact as wc
from verification import hertz
from verification.setup import Ask, Pose, vertex_areas

E_STAR = hertz.modulus(hertz.YOUNG)  # [Pa]
LOAD = 100.0  # about F' [N/m]
WIDTH, HEIGHT = 0.06, 0.08  # half the width and the height of the part of the cylinder [m]
ACROSS = 2  # cells along the line
COLUMNS = {1: 8, 2: 10, 4: 14}  # from the middle to a side, for each N; as many layers
FIT = 0.92  # of b: the N elements end there


def half_width(load: float, radius: float, e_star: float) -> float:
    """Exact b [m] at the force per length ``load`` [N/m]."""
    return float(np.sqrt(4.0 * load * radius / (np.pi * e_star)))


def peak(load: float, radius: float, e_star: float) -> float:
    """Exact p0 [Pa] at the force per length ``load`` [N/m]."""
    return float(np.sqrt(load * e_star / (np.pi * radius)))


def exact(load: float) -> tuple[float, float]:
    """Both for this cylinder."""
    return half_width(load, hertz.RADIUS, E_STAR), peak(load, hertz.RADIUS, E_STAR)


def run(ask: Ask) -> Iterator[Figure]:
    """1, 2 and 4 elements across; quick leaves 4 and the turned ones out."""
    for n in hertz.COUNTS[: 2 if ask.quick else None]:
        for turned in (False,) if ask.quick else (False, True):
            yield from on_plane(ask, n, Pose(turned))


def slab(size: float, columns: int) -> wc.TetMesh:
    """The slice about its lowest line, the y axis, with elements of ``size`` [m] there."""
    box = wc.box((2.0, ACROSS * size, 1.0), (2 * columns, ACROSS, columns))
    s, y, t = box.vertices.T
    x = WIDTH * np.sign(s) * hertz.graded(np.abs(s), size / WIDTH * columns)
    low = hertz.RADIUS - np.sqrt(hertz.RADIUS**2 - x**2)
    z = low + (HEIGHT - low) * hertz.graded(t + 0.5, size / HEIGHT * columns)
    return wc.TetMesh(np.stack([x, y, z], axis=1), box.tets)


def on_plane(ask: Ask, n: int, pose: Pose) -> Iterator[Figure]:
    """Force, half-width, peak and profile of the pressure."""
    b = half_width(LOAD, hertz.RADIUS, E_STAR)
    # About the force asked for (Johnson 1985, sec. 5.6, nu = 0).
    depth = LOAD / (np.pi * E_STAR) * 2.0 * np.log(2.0 * HEIGHT / b)
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    scene.add_plane(pose.out((0.0, 0.0, 1.0)), depth)
    mesh = slab(FIT * b / n, COLUMNS[n])
    hertz.hold(scene, mesh, wc.Corotated(E_STAR, 0.0, hertz.DENSITY), pose.q)
    sim, p = hertz.settle(ask, scene, FIT * b / n, E_STAR, 0.0, HEIGHT)
    rows = by_row(mesh, p * vertex_areas(sim), pose.back(sim.positions())[:, 0])
    label, names = f"A3 cylinder on plane, N = {n} {pose}", ("force [N/m]", "half-width")
    yield from hertz.profile(label, names, rows, exact, 4.0, n)


def by_row(mesh: wc.TetMesh, force: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, ...]:
    """Places [m], pressures [Pa] and widths [m] of the rows of vertices along the line.

    ``force`` [N] and ``at`` [m] are of each vertex: its force, its place across the line.
    """
    rest, row = np.unique(np.round(mesh.vertices[:, 0], 9), return_inverse=True)
    per_row = np.bincount(row, force)
    x = np.bincount(row, at * force, len(rest)) / np.maximum(per_row, 1e-30)
    x = np.where(per_row > 0.0, x, rest)
    width = np.gradient(x)
    return x, per_row / np.ptp(mesh.vertices[:, 1]) / width, width
