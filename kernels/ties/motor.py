"""Motors of hinges and sliders: what they are, and how fast they go.

    u = (v_a - v_b) . e  at the axis of a slider,  (w_a - w_b) . e  of a hinge      [m/s], [1/s]

e is the axis as it lies. drive.py has their impulses. The place q of a slider is C . e, by tie.py.
That of a hinge is the angle about e from a vertex of the second body to one of the first, less that
at the start; of the angles that differ by whole turns it is the one nearest to the last place.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import RIGID, Implicit, RigidMotion, as_vec3, as_vec3d
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.ties.attachment import Attachments, is_awake
from warp_contact.kernels.ties.tie import Ties, direction

wp.set_module_options(OPTIONS)


@wp.struct
class Motors:
    """Motors of attachments; arrays have the shape (n_attachment,) where nothing is said."""

    first: wp.array[int]  # (n_cluster + 1,) first attachment of each cluster in ``which``
    which: wp.array[int]  # (n_motor,) hinges and sliders, by cluster
    row: wp.array[int]  # (n_cluster,) where each begins in y and z
    block: wp.array[int]  # (n_cluster,) where each begins in w
    y: wp.array[wp.vec3d]  # (n_row,) J G M^T of each motor, at each tie of its cluster
    z: wp.array[wp.vec3d]  # (n_row,) K^-1 J G M^T
    w: wp.array[wp.float64]  # (n_block,) W of each cluster
    axis: wp.array[wp.vec3]  # e
    at: wp.array[wp.vec3]  # [m] where a slider acts
    to: wp.array[float]  # [N s], [N m s] p after this round
    lacks: wp.array[float]  # [m/s], [1/s] s + l - u
    turns: wp.array[int]  # 1 for a hinge
    speed: wp.array[float]  # [m/s], [1/s] s
    target: wp.array[float]  # [m], [rad] q to be reached at a speed up to s, nan for none
    place: wp.array[float]  # [m], [rad] q when the last step began that asked for it
    mark: wp.array[wp.vec2i]  # vertices away from the axis of a hinge, -1 for the world
    toward: wp.array[wp.vec3]  # what stands for the second where that is the world
    turned: wp.array[float]  # [rad] the angle at the start
    limit: wp.array[float]  # [N], [N m] F, 0 where there is no motor
    force: wp.array[float]  # [N], [N m] in the last step, along e on the first body
    p: wp.array[float]  # [N s], [N m s] in this step
    reached: wp.array[float]  # [m/s], [1/s] u before the contacts
    lost: wp.array[float]  # [m/s], [1/s] l
    sum: wp.array[wp.float64]  # [N s], [N m s] since the frame began
    by: RigidMotion  # of each body, by a round


@wp.func
def point_of(t: int, ties: Ties, x: wp.array[wp.vec3]) -> wp.vec3d:
    """The point of the first body at tie t [m]."""
    v = ties.vert[t]
    w = ties.weight[t]
    out = as_vec3d(x[v[0]])
    for k in range(1, 4):
        out += wp.float64(w[k]) * as_vec3d(x[v[k]] - x[v[0]])
    return out


@wp.func
def axis_of(a: int, of: Attachments, motors: Motors, ties: Ties, x: wp.array[wp.vec3]) -> wp.vec3:
    """The axis e of an attachment."""
    t = of.tie[of.first[a]]
    if motors.turns[a] == 0:
        return as_vec3(direction(t, ties, x))
    last = of.tie[of.first[a + 1] - 1]
    return as_vec3(wp.normalize(point_of(last, ties, x) - point_of(t, ties, x)))


@wp.func
def middle_of(a: int, of: Attachments, ties: Ties, x: wp.array[wp.vec3]) -> wp.vec3:
    """Where a slider acts [m]: the middle of its points on the first body."""
    out = wp.vec3d()
    for k in range(of.first[a], of.first[a + 1]):
        out += point_of(of.tie[k], ties, x)
    return as_vec3(out / wp.float64(of.first[a + 1] - of.first[a]))


@wp.func
def fixed_motion(b: int, v: wp.array[wp.vec3], x: wp.array[wp.vec3], d: Implicit) -> wp.vec3:
    """Angular velocity [1/s] of a body whose vertices are all led."""
    first = d.body_vert[b]
    n = wp.float64(d.body_vert[b + 1] - first)
    middle = wp.vec3d()
    mean = wp.vec3d()
    for i in range(first, d.body_vert[b + 1]):
        middle += as_vec3d(x[i]) / n
        mean += as_vec3d(v[i]) / n
    inertia = wp.mat33d()
    spin = wp.vec3d()
    for i in range(first, d.body_vert[b + 1]):
        r = as_vec3d(x[i]) - middle
        inertia += wp.dot(r, r) * wp.identity(n=3, dtype=wp.float64) - wp.outer(r, r)
        spin += wp.cross(r, as_vec3d(v[i]) - mean)
    scale = wp.trace(inertia)
    return as_vec3(wp.inverse(inertia / scale) * spin / scale)


@wp.func
def tied_speed(a: int, e: wp.vec3, of: Attachments, ties: Ties, v: wp.array[wp.vec3]) -> float:
    """The speed u of a slider [m/s]: the mean over its points."""
    u = wp.float64(0.0)
    for k in range(of.first[a], of.first[a + 1]):
        t = of.tie[k]
        for m in range(8):
            part = wp.dot(as_vec3d(v[ties.vert[t][m]]), as_vec3d(e))
            u += wp.float64(ties.now[t][m]) * part
    return wp.float32(u / wp.float64(of.first[a + 1] - of.first[a]))


@wp.func
def spin_of(
    b: int, v: wp.array[wp.vec3], x: wp.array[wp.vec3], d: Implicit, motion: RigidMotion
) -> wp.vec3:
    """Angular velocity of a rigid body, or 0 of the world [1/s]."""
    if b < 0:
        return wp.vec3(0.0, 0.0, 0.0)
    if d.kind[b] == RIGID:
        return motion.w[b]
    return fixed_motion(b, v, x, d)


@wp.func
def speed_of(
    a: int,
    e: wp.vec3,
    of: Attachments,
    motors: Motors,
    ties: Ties,
    v: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    d: Implicit,
    motion: RigidMotion,
) -> float:
    """The speed u of an attachment [m/s], [1/s]."""
    if motors.turns[a] == 0:
        return tied_speed(a, e, of, ties, v)
    turning = spin_of(of.body[a][0], v, x, d, motion) - spin_of(of.body[a][1], v, x, d, motion)
    return wp.dot(turning, e)


@wp.func
def arm_of(i: int, p: wp.vec3d, e: wp.vec3d, x: wp.array[wp.vec3]) -> wp.vec3d:
    """The way [m] from an axis through p to vertex i."""
    r = as_vec3d(x[i]) - p
    return r - wp.dot(r, e) * e


@wp.func
def place_of(a: int, of: Attachments, motors: Motors, ties: Ties, x: wp.array[wp.vec3]) -> float:
    """The place q of an attachment [m], [rad]."""
    t = of.tie[of.first[a]]
    if motors.turns[a] == 0:
        c = wp.vec3d()
        for k in range(8):
            c += wp.float64(ties.weight[t][k]) * as_vec3d(x[ties.vert[t][k]])
        return wp.float32(wp.dot(c - as_vec3d(ties.point[t]), direction(t, ties, x)))
    e = as_vec3d(axis_of(a, of, motors, ties, x))
    p = point_of(t, ties, x)
    one = arm_of(motors.mark[a][0], p, e, x)
    other = as_vec3d(motors.toward[a])
    if motors.mark[a][1] >= 0:
        other = arm_of(motors.mark[a][1], p, e, x)
    angle = wp.atan2(wp.dot(e, wp.cross(other, one)), wp.dot(other, one))
    turn = wp.float64(2.0 * wp.pi)
    more = angle - wp.float64(motors.turned[a]) - wp.float64(motors.place[a])
    return motors.place[a] + wp.float32(more - turn * wp.round(more / turn))


@wp.kernel
def find_places(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    of: Attachments,
    motors: Motors,
    ties: Ties,
    # out
    place: wp.array[float],  # (n_attachment,) [m], [rad] 0 of those that are no hinge or slider
):
    """One thread per hinge or slider: its place."""
    a = motors.which[wp.tid()]
    place[a] = place_of(a, of, motors, ties, x)


@wp.kernel
def begin_frame(
    # in
    awake: wp.array[int],  # (n_body,)
    of: Attachments,
    # in, out
    motors: Motors,
):
    """One thread per attachment: forget the force of the last frame, but of bodies asleep."""
    a = wp.tid()
    if is_awake(a, of, awake):
        motors.sum[a] = wp.float64(0.0)


@wp.kernel
def look(
    # in
    last: bool,  # in the step: contacts have acted
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    d: Implicit,
    motion: RigidMotion,  # of v
    of: Attachments,
    ties: Ties,
    # in, out
    motors: Motors,
):
    """One thread per attachment: the speed of its motor, before and after the contacts.

    What sleeps, or waits for its turn, keeps all for its next step.
    """
    a = wp.tid()
    if not is_awake(a, of, d.awake):
        return
    if motors.limit[a] == 0.0:
        motors.lost[a] = 0.0
        return
    u = speed_of(a, motors.axis[a], of, motors, ties, v, x, d, motion)
    if not last:
        motors.reached[a] = u
        return
    h = dt[ties.vert[of.tie[of.first[a]]][0]]
    motors.lost[a] = motors.reached[a] - u
    motors.force[a] = motors.p[a] / h
    motors.sum[a] = motors.sum[a] + wp.float64(motors.p[a])
