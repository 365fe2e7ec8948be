"""Bodies that take implicit steps: their present shape, as far as their mobility depends on it.

    R_i = polar part of F_i,  F_i = sum of volume times deformation gradient of its tets     [m^3]
    M_r = U^T M U                               mass and moments of inertia          [kg], [kg m^2]

R_i turns the rest shape into the present one around vertex i. U are the rigid motions.
"""

import warp as wp

from warp_contact.kernels.elastic import tet as element
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

LUMPED = wp.constant(0)  # takes explicit steps, or is fixed as a whole
FREE = wp.constant(1)
HELD = wp.constant(2)  # some of its vertices are fixed
RIGID = wp.constant(3)

FOUR = wp.constant(4)  # vertices whose answers are summed together: vectors fit into a CPU's
vec12 = wp.types.vector(length=12, dtype=float)
mat3x12 = wp.types.matrix(shape=(3, 12), dtype=float)

UPRIGHT = wp.constant(0.05)  # determinant, of a gradient of size 1: above it Newton is fast
ROUNDS = wp.constant(8)
EXACT = wp.constant(1.0e-4)  # a last change this small leaves an error of its square


@wp.struct
class Implicit:
    """What kernels know of the bodies that take implicit steps."""

    h: wp.array[float]  # (n_body,) [s] length of the step that its blocks belong to
    kind: wp.array[int]  # (n_body,)
    awake: wp.array[int]  # (n_body,) 0 asleep
    body_vert: wp.array[int]  # (n_body + 1,)
    vert_body: wp.array[int]  # (n_vert,)
    mass: wp.array[float]  # (n_vert,) [kg]
    inv_mass: wp.array[float]  # (n_vert,) [1/kg], 0 for a fixed vertex
    first: wp.array[int]  # (n_body,) first block of its shape, for its step
    block: wp.array[mat3x12]  # (n_block,) B_ji of the shapes, by rows i, four at once [1/kg]
    norm: wp.array[wp.vec4]  # (n_block,) spectral norms of (A0^-1)_ij [1/kg]
    rest: wp.array[wp.vec3]  # (n_vert,) [m] from the centre of mass at rest, as the shape was made
    rest_inertia: wp.array[wp.mat33]  # (n_body,) [1/(kg m^2)] the same, inverted
    placed: wp.array[wp.mat33]  # (n_body,) rotation of its shape when it was placed
    turn: wp.array[wp.mat33]  # (n_vert,) R_i
    centre: wp.array[wp.vec3]  # (n_body,) [m] of mass
    inv_total: wp.array[float]  # (n_body,) [1/kg] of its mass; 0 for a body that is held
    inv_inertia: wp.array[wp.mat33]  # (n_body,) [1/(kg m^2)]; 0 for a body that is held
    force: wp.array[wp.vec3]  # (n_body,) [N] from outside
    torque: wp.array[wp.vec3]  # (n_body,) [N m] from outside


@wp.struct
class RigidMotion:
    """The rigid motion of each body."""

    v: wp.array[wp.vec3]  # (n_body,) [m/s] of its centre
    w: wp.array[wp.vec3]  # (n_body,) [1/s]


@wp.func
def moves(b: int, d: Implicit) -> bool:
    """Whether a body takes implicit steps, and is awake."""
    return d.kind[b] != LUMPED and d.awake[b] != 0


@wp.func
def floats(b: int, d: Implicit) -> bool:
    """Whether a body has no fixed vertices: its rigid motion is its own."""
    return d.kind[b] == FREE or d.kind[b] == RIGID


@wp.func
def deforms(b: int, d: Implicit) -> bool:
    """Whether a body takes implicit steps, and is not rigid."""
    return moves(b, d) and d.kind[b] != RIGID


@wp.func
def block_of(i: int, d: Implicit) -> int:
    """First block of the four vertices to which vertex i belongs; one follows for each vertex."""
    b = d.vert_body[i]
    first = d.body_vert[b]
    return d.first[b] + (i - first) // FOUR * (d.body_vert[b + 1] - first)


@wp.func
def rigid_at(i: int, b: int, x: wp.vec3, d: Implicit, motion: RigidMotion) -> wp.vec3:
    """Velocity [m/s] of the rigid motion of body b at its vertex i."""
    return motion.v[b] + wp.cross(motion.w[b], x - d.centre[b])


@wp.func
def acceleration(i: int, b: int, x: wp.vec3, d: Implicit) -> wp.vec3:
    """By the force and torque from outside, at vertex i of body b [m/s^2]."""
    return d.inv_total[b] * d.force[b] + wp.cross(d.inv_inertia[b] * d.torque[b], x - d.centre[b])


@wp.func
def as_vec3d(a: wp.vec3) -> wp.vec3d:
    return wp.vec3d(wp.float64(a[0]), wp.float64(a[1]), wp.float64(a[2]))


@wp.func
def as_vec3(a: wp.vec3d) -> wp.vec3:
    return wp.vec3(wp.float32(a[0]), wp.float32(a[1]), wp.float32(a[2]))


@wp.func
def as_mat33(a: wp.mat33d) -> wp.mat33:
    out = wp.mat33(0.0)
    for k in range(3):
        for l in range(3):
            out[k, l] = wp.float32(a[k, l])
    return out


@wp.func
def centre_of(b: int, x: wp.array[wp.vec3], d: Implicit) -> wp.vec3:
    """Centre of mass of body b [m]."""
    first = d.body_vert[b]
    origin = x[first]
    total = wp.float64(0.0)
    moment = wp.vec3d()
    for i in range(first, d.body_vert[b + 1]):
        m = wp.float64(d.mass[i])
        total += m
        moment += m * as_vec3d(x[i] - origin)
    return origin + as_vec3(moment / total)


@wp.kernel
def find_bodies(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    d: Implicit,
):
    """One thread per body: its centre, mass and inertia at the present shape."""
    b = wp.tid()
    d.inv_total[b] = 0.0
    d.inv_inertia[b] = wp.mat33(0.0)
    if not moves(b, d):
        return
    first = d.body_vert[b]
    last = d.body_vert[b + 1]
    c = centre_of(b, x, d)
    d.centre[b] = c
    if d.kind[b] == HELD:
        return
    total = wp.float64(0.0)
    inertia = wp.mat33d()
    for i in range(first, last):
        total += wp.float64(d.mass[i])
        r = as_vec3d(x[i] - c)
        inertia += wp.float64(d.mass[i]) * (
            wp.dot(r, r) * wp.identity(n=3, dtype=wp.float64) - wp.outer(r, r)
        )
    scale = wp.trace(inertia)
    inverse = wp.inverse(inertia / scale)
    d.inv_total[b] = wp.float32(wp.float64(1.0) / total)
    d.inv_inertia[b] = as_mat33(inverse / scale)


@wp.kernel
def find_gradients(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,)
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
    volume: wp.array[float],  # (n_tet,) [m^3]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # out
    gradient: wp.array[wp.mat33],  # (n_tet,) [m^3]
):
    """One thread per tet: its deformation gradient times its volume."""
    q = wp.tid()
    if deforms(d.vert_body[tets[q][0]], d):
        gradient[q] = volume[q] * element.rate(q, tets, pose, x)


@wp.func
def polar(f: wp.mat33) -> wp.mat33:
    """The rotation nearest to f."""
    size = wp.sqrt(wp.ddot(f, f) / 3.0)
    r = f / size
    if wp.determinant(r) > UPRIGHT:  # Newton's iteration (Higham 1986)
        for _ in range(ROUNDS):
            other = wp.transpose(wp.inverse(r))
            off = 0.5 * (other - r)
            r += off
            if wp.ddot(off, off) < EXACT * EXACT:
                return r
    u = wp.mat33()
    s = wp.vec3()
    v = wp.mat33()
    wp.svd3(f, u, s, v)
    r = u @ wp.transpose(v)
    if wp.determinant(r) < 0.0:  # the smallest singular value is the last
        flip = wp.diag(wp.vec3(1.0, 1.0, -1.0))
        r = u @ flip @ wp.transpose(v)
    return r


@wp.kernel
def find_turns(
    # in
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    gradient: wp.array[wp.mat33],  # (n_tet,) [m^3]
    # in, out
    d: Implicit,
):
    """One thread per vertex: R_i."""
    i = wp.tid()
    b = d.vert_body[i]
    if not deforms(b, d):
        return
    f = wp.mat33(0.0)
    for k in range(vt_start[i], vt_start[i + 1]):
        f += gradient[vt_corner[k] // 4]
    d.turn[i] = polar(f) @ d.placed[b]


@wp.kernel
def keep_shapes(
    # in
    d: Implicit,
    # in, out
    x: wp.array[wp.vec3],  # (n_vert,) [m]
):
    """One thread per rigid body: the shape at rest, moved to where the body is.

    Without it, rounding would change the shape over many steps.
    """
    b = wp.tid()
    if d.kind[b] != RIGID or d.awake[b] == 0:
        return
    first = d.body_vert[b]
    last = d.body_vert[b + 1]
    c = centre_of(b, x, d)
    now = wp.mat33d()
    before = wp.mat33d()
    for i in range(first, last):
        r = as_vec3d(d.rest[i])
        now += wp.float64(d.mass[i]) * wp.outer(as_vec3d(x[i] - c), r)
        before += wp.float64(d.mass[i]) * wp.outer(r, r)
    scale = wp.trace(before)
    turn = polar(as_mat33((now / scale) * wp.inverse(before / scale)))
    for i in range(first, last):
        x[i] = c + turn * d.rest[i]
