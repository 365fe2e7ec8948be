"""How a body that takes implicit steps answers impulses at its vertices.

    G  = P S P^T + U M_r^-1 U^T                 dv = G p          mobility            [1/kg]
    S_ij = R_i (A0^-1)_ij R_j^T                 A0 = M + h C0 + h^2 K0                 [kg]
    P  = 1 - U M_r^-1 U^T M,  M_r = U^T M U     U the rigid motions at the present shape
    A0^-1 = B + U0 M_r0^-1 U0^T                 U0 those at rest, B stored             [1/kg]

A0 is the matrix of an implicit step of the shape at rest. Its inverse is made once for each shape,
material and length of the step, and shared by all bodies of that shape. R_i turns the rest shape
into the present one around vertex i: the polar part of the mean deformation gradient of its tets.
The part B of A0^-1 that deforms the body is stored without the rigid one, beside which that of a
stiff body would be lost in rounding.
P takes the rigid part out of a velocity, P^T that of an impulse, so that a body gets exactly the
linear and angular momentum of the impulses, whatever S is. A body with fixed vertices has S alone.
"""

import warp as wp

from warp_contact.kernels.elastic import tet as element
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

LUMPED = wp.constant(0)  # takes explicit steps, or is fixed as a whole
FREE = wp.constant(1)
HELD = wp.constant(2)  # some of its vertices are fixed


@wp.struct
class Implicit:
    """What kernels know of the bodies that take implicit steps."""

    h: wp.array[float]  # (1,) [s] length of the step that the blocks belong to
    kind: wp.array[int]  # (n_body,)
    awake: wp.array[int]  # (n_body,) 0 asleep
    body_vert: wp.array[int]  # (n_body + 1,)
    vert_body: wp.array[int]  # (n_vert,)
    mass: wp.array[float]  # (n_vert,) [kg]
    inv_mass: wp.array[float]  # (n_vert,) [1/kg], 0 for a fixed vertex
    first: wp.array[int]  # (n_body,) first block of its shape
    block: wp.array[wp.mat33]  # B_ij of the shapes, by rows [1/kg]
    norm: wp.array[float]  # spectral norms of (A0^-1)_ij [1/kg]
    rest: wp.array[wp.vec3]  # (n_vert,) [m] from the centre of mass at rest, as the shape was made
    rest_inertia: wp.array[wp.mat33]  # (n_body,) [1/(kg m^2)] the same, inverted
    placed: wp.array[wp.mat33]  # (n_body,) rotation of its shape when it was placed
    turn: wp.array[wp.mat33]  # (n_vert,) R_i
    centre: wp.array[wp.vec3]  # (n_body,) [m] of mass
    inv_total: wp.array[float]  # (n_body,) [1/kg] of its mass; 0 for a body that is held
    inv_inertia: wp.array[wp.mat33]  # (n_body,) [1/(kg m^2)]; 0 for a body that is held


@wp.struct
class Rigid:
    """Rigid motion of each body."""

    v: wp.array[wp.vec3]  # (n_body,) [m/s] of its centre
    w: wp.array[wp.vec3]  # (n_body,) [1/s]


@wp.func
def moves(b: int, d: Implicit) -> bool:
    """Whether a body takes implicit steps, and is awake."""
    return d.kind[b] != LUMPED and d.awake[b] != 0


@wp.func
def rigid_at(i: int, b: int, x: wp.vec3, d: Implicit, motion: Rigid) -> wp.vec3:
    """Velocity [m/s] of the rigid motion of body b at its vertex i."""
    return motion.v[b] + wp.cross(motion.w[b], x - d.centre[b])


@wp.func
def vec3d(a: wp.vec3) -> wp.vec3d:
    return wp.vec3d(wp.float64(a[0]), wp.float64(a[1]), wp.float64(a[2]))


@wp.func
def vec3f(a: wp.vec3d) -> wp.vec3:
    return wp.vec3(wp.float32(a[0]), wp.float32(a[1]), wp.float32(a[2]))


@wp.func
def mat33f(a: wp.mat33d) -> wp.mat33:
    out = wp.mat33(0.0)
    for k in range(3):
        for l in range(3):
            out[k, l] = wp.float32(a[k, l])
    return out


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
    origin = x[first]
    total = wp.float64(0.0)
    moment = wp.vec3d()
    for i in range(first, last):
        m = wp.float64(d.mass[i])
        total += m
        moment += m * vec3d(x[i] - origin)
    c = origin + vec3f(moment / total)
    d.centre[b] = c
    if d.kind[b] == HELD:
        return
    inertia = wp.mat33d()
    for i in range(first, last):
        r = vec3d(x[i] - c)
        inertia += wp.float64(d.mass[i]) * (
            wp.dot(r, r) * wp.identity(n=3, dtype=wp.float64) - wp.outer(r, r)
        )
    scale = wp.trace(inertia)
    inverse = wp.inverse(inertia / scale)
    d.inv_total[b] = wp.float32(wp.float64(1.0) / total)
    d.inv_inertia[b] = mat33f(inverse / scale)


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
    if moves(d.vert_body[tets[q][0]], d):
        gradient[q] = volume[q] * element.rate(q, tets, pose, x)


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
    if not moves(b, d):
        return
    f = wp.mat33(0.0)
    for k in range(vt_start[i], vt_start[i + 1]):
        f += gradient[vt_corner[k] // 4]
    u = wp.mat33()
    s = wp.vec3()
    v = wp.mat33()
    wp.svd3(f, u, s, v)
    r = u @ wp.transpose(v)
    if wp.determinant(r) < 0.0:  # the smallest singular value is the last
        flip = wp.diag(wp.vec3(1.0, 1.0, -1.0))
        r = u @ flip @ wp.transpose(v)
    d.turn[i] = r @ d.placed[b]


@wp.kernel
def response_to(
    # in
    p: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # out
    motion: Rigid,
    busy: wp.array[int],  # (n_body,) 1 where p is not 0
):
    """One thread per body: its rigid motion by impulses."""
    b = wp.tid()
    busy[b] = 0
    if not moves(b, d):
        return
    c = d.centre[b]
    total = wp.vec3d()
    turning = wp.vec3d()
    for i in range(d.body_vert[b], d.body_vert[b + 1]):
        if wp.length_sq(p[i]) > 0.0:
            busy[b] = 1
            q = vec3d(p[i])
            total += q
            turning += wp.cross(vec3d(x[i] - c), q)
    motion.v[b] = d.inv_total[b] * vec3f(total)
    motion.w[b] = d.inv_inertia[b] * vec3f(turning)


@wp.kernel
def rigid_part(
    # in
    y: wp.array[wp.vec3],  # (n_vert,) [m/s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # out
    motion: Rigid,
):
    """One thread per body without fixed vertices: the rigid part of velocities."""
    b = wp.tid()
    if not moves(b, d) or d.kind[b] != FREE:
        return
    c = d.centre[b]
    total = wp.vec3d()
    turning = wp.vec3d()
    for i in range(d.body_vert[b], d.body_vert[b + 1]):
        p = wp.float64(d.mass[i]) * vec3d(y[i])
        total += p
        turning += wp.cross(vec3d(x[i] - c), p)
    motion.v[b] = d.inv_total[b] * vec3f(total)
    motion.w[b] = d.inv_inertia[b] * vec3f(turning)


@wp.kernel
def to_rest(
    # in
    p: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    motion: Rigid,  # by p
    busy: wp.array[int],  # (n_body,)
    # out
    z: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
):
    """One thread per vertex: R^T P^T p."""
    i = wp.tid()
    b = d.vert_body[i]
    if busy[b] == 0:
        return
    z[i] = wp.vec3(0.0, 0.0, 0.0)
    if d.inv_mass[i] > 0.0:
        z[i] = wp.transpose(d.turn[i]) * (p[i] - d.mass[i] * rigid_at(i, b, x[i], d, motion))


@wp.kernel
def at_rest(
    # in
    z: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    d: Implicit,
    busy: wp.array[int],  # (n_body,)
    # out
    motion: Rigid,
):
    """One thread per body without fixed vertices: the rigid motion at rest by impulses z."""
    b = wp.tid()
    motion.v[b] = wp.vec3(0.0, 0.0, 0.0)
    motion.w[b] = wp.vec3(0.0, 0.0, 0.0)
    if busy[b] == 0 or d.kind[b] != FREE:
        return
    total = wp.vec3d()
    turning = wp.vec3d()
    for i in range(d.body_vert[b], d.body_vert[b + 1]):
        q = vec3d(z[i])
        total += q
        turning += wp.cross(vec3d(d.rest[i]), q)
    motion.v[b] = d.inv_total[b] * vec3f(total)
    motion.w[b] = d.rest_inertia[b] * vec3f(turning)


@wp.kernel
def multiply(
    # in
    z: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    d: Implicit,
    rest: Rigid,  # rigid motion at rest by z
    busy: wp.array[int],  # (n_body,)
    # out
    y: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: R A0^-1 z."""
    i = wp.tid()
    b = d.vert_body[i]
    if busy[b] == 0:
        return
    first = d.body_vert[b]
    n = d.body_vert[b + 1] - first
    row = d.first[b] + (i - first) * n
    s = rest.v[b] + wp.cross(rest.w[b], d.rest[i])
    for j in range(n):
        s += d.block[row + j] * z[first + j]
    y[i] = d.turn[i] * s


@wp.kernel
def add_rigid(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    wrong: Rigid,  # with the velocities y
    right: Rigid,  # by the impulses
    busy: wp.array[int],  # (n_body,)
    # in, out
    y: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: give y the rigid motion that it should have."""
    i = wp.tid()
    b = d.vert_body[i]
    if busy[b] == 0:
        y[i] = wp.vec3(0.0, 0.0, 0.0)
    elif d.kind[b] == FREE:
        y[i] = y[i] - rigid_at(i, b, x[i], d, wrong) + rigid_at(i, b, x[i], d, right)
