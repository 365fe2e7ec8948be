"""How motors (motor.py) lead two bodies to a speed, by a limited force or torque.

    W = M G M^T - (J G M^T)^T K^-1 (J G M^T),   u = M v                  of the motors of a cluster
    W dp = s + l - u,   |p + dp| <= h F                                          [N s], [N m s]

s is the speed asked for, or with a target the one that leads there in this step; F is the limit, J
and K are those of the ties (matrix.py). So W is what motors feel of all that hangs together; dp is
found by Gauss and Seidel (projected). p starts from the force of the last step. Contacts come later
in the step and find p as it is: the limit holds whatever is in the way. What they took from u in
the last step, l, is asked for in this one. Towards a target s is no faster than BRAKING of the
limit could stop before it.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import RIGID, Implicit, RigidMotion, as_vec3d
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.ties.attachment import Attachments
from warp_contact.kernels.ties.motor import Motors, axis_of, middle_of, place_of, speed_of
from warp_contact.kernels.ties.solve import find_pulls
from warp_contact.kernels.ties.tie import HELD, Ties, across

wp.set_module_options(OPTIONS)

BRAKING = wp.constant(0.5)  # part of the limit that slows down towards a target
SWEEPS = wp.constant(32)  # over the motors of a cluster

# What a round does.
AGAIN = wp.constant(0)  # p of the last step
FURTHER = wp.constant(1)  # p + dp


@wp.struct
class Pair:
    """How both bodies of a motor move by a unit impulse of it."""

    one: int
    other: int  # -1 for the world
    v_one: wp.vec3  # [1/kg], 0 for a hinge
    w_one: wp.vec3
    v_other: wp.vec3
    w_other: wp.vec3


@wp.func
def answer_of(a: int, turns: bool, e: wp.vec3, at: wp.vec3, of: Attachments, d: Implicit) -> Pair:
    """G M^T of an attachment."""
    out = Pair()
    out.one = of.body[a][0]
    out.other = of.body[a][1]
    for k in range(2):
        b = of.body[a][k]
        if b >= 0:
            turning = e
            moved = wp.vec3(0.0, 0.0, 0.0)
            if not turns:
                turning = wp.cross(at - d.centre[b], e)
                moved = d.inv_total[b] * e
            turning = d.inv_inertia[b] * turning
            if k == 0:
                out.v_one = moved
                out.w_one = turning
            else:
                out.v_other = -moved
                out.w_other = -turning
    return out


@wp.func
def velocity_at(b: int, x: wp.vec3, by: Pair, d: Implicit) -> wp.vec3:
    """Velocity of a point of body b by a unit impulse."""
    u = wp.vec3(0.0, 0.0, 0.0)
    if b == by.one:
        u = by.v_one + wp.cross(by.w_one, x - d.centre[b])
    elif b == by.other:
        u = by.v_other + wp.cross(by.w_other, x - d.centre[b])
    return u


@wp.func
def spin_by(b: int, by: Pair) -> wp.vec3:
    """Angular velocity of body b by a unit impulse."""
    w = wp.vec3(0.0, 0.0, 0.0)
    if b >= 0:
        if b == by.one:
            w = by.w_one
        elif b == by.other:
            w = by.w_other
    return w


@wp.func
def direct(a: int, of: Attachments, motors: Motors, by: Pair, d: Implicit) -> float:
    """An entry of M G M^T: what a unit impulse gives attachment a."""
    one = of.body[a][0]
    other = of.body[a][1]
    e = motors.axis[a]
    u = wp.vec3(0.0, 0.0, 0.0)
    if motors.turns[a] != 0:
        u = spin_by(one, by) - spin_by(other, by)
    else:
        u = velocity_at(one, motors.at[a], by, d)
        if other >= 0:
            u -= velocity_at(other, motors.at[a], by, d)
    return wp.dot(u, e)


@wp.func
def is_on(a: int, of: Attachments, motors: Motors) -> bool:
    """Whether a motor drives an attachment."""
    return motors.limit[a] > 0.0 and of.broken[a] == 0


@wp.kernel
def respond(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    of: Attachments,
    # in, out
    ties: Ties,
    motors: Motors,
):
    """One thread per cluster: W of its motors, and where they act."""
    c = wp.tid()
    first = motors.first[c]
    m = motors.first[c + 1] - first
    n = ties.first[c + 1] - ties.first[c]
    for k in range(m):
        a = motors.which[first + k]
        if not is_on(a, of, motors):
            continue
        motors.axis[a] = axis_of(a, of, motors, ties, x)
        motors.at[a] = middle_of(a, of, ties, x)
        by = answer_of(a, motors.turns[a] != 0, motors.axis[a], motors.at[a], of, d)
        for t in range(ties.first[c], ties.first[c + 1]):
            y = wp.vec3d()
            if ties.state[t] == HELD:
                for l in range(8):
                    i = ties.vert[t][l]
                    u = velocity_at(d.vert_body[i], x[i], by, d)
                    y += wp.float64(ties.now[t][l]) * as_vec3d(u)
                y = across(y, as_vec3d(ties.line[t]))
            ties.pull[t] = y
            motors.y[motors.row[c] + k * n + t - ties.first[c]] = y
        find_pulls(c, ties)
        for t in range(n):
            motors.z[motors.row[c] + k * n + t] = ties.pull[ties.first[c] + t]
    for k in range(m):
        a = motors.which[first + k]
        if not is_on(a, of, motors):
            continue
        by = answer_of(a, motors.turns[a] != 0, motors.axis[a], motors.at[a], of, d)
        for l in range(m):
            if is_on(motors.which[first + l], of, motors):
                s = wp.float64(direct(motors.which[first + l], of, motors, by, d))
                for t in range(n):
                    y = motors.y[motors.row[c] + l * n + t]
                    s -= wp.dot(y, motors.z[motors.row[c] + k * n + t])
                motors.w[motors.block[c] + k * m + l] = s


@wp.func
def add_to(b: int, part: float, v: wp.vec3, w: wp.vec3, by: RigidMotion):
    if b >= 0:
        by.v[b] = by.v[b] + part * v
        by.w[b] = by.w[b] + part * w


@wp.func
def clear(b: int, by: RigidMotion):
    if b >= 0:
        by.v[b] = wp.vec3(0.0, 0.0, 0.0)
        by.w[b] = wp.vec3(0.0, 0.0, 0.0)


@wp.kernel
def drive(
    # in
    round: int,
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    d: Implicit,
    motion: RigidMotion,  # of v
    of: Attachments,
    # in, out
    ties: Ties,
    motors: Motors,
):
    """One thread per cluster: what its motors add in this round."""
    c = wp.tid()
    ties.moved[c] = 1
    first = motors.first[c]
    m = motors.first[c + 1] - first
    for k in range(m):
        a = motors.which[first + k]
        clear(of.body[a][0], motors.by)
        clear(of.body[a][1], motors.by)
        motors.to[a] = 0.0
        if not is_on(a, of, motors):
            motors.force[a] = 0.0
            motors.p[a] = 0.0
        elif round == AGAIN:
            most = motors.limit[a]
            h = dt[ties.vert[of.tie[of.first[a]]][0]]
            motors.p[a] = 0.0
            motors.to[a] = h * wp.clamp(motors.force[a], -most, most)
        else:
            u = speed_of(a, motors.axis[a], of, motors, ties, v, x, d, motion)
            asked = motors.speed[a]
            if not wp.isnan(motors.target[a]):
                motors.place[a] = place_of(a, of, motors, ties, x)
                h = dt[ties.vert[of.tie[of.first[a]]][0]]
                left = motors.target[a] - motors.place[a]
                brakes = motors.limit[a] * wp.float32(motors.w[motors.block[c] + k * m + k])
                most = wp.min(wp.abs(asked), wp.sqrt(BRAKING * 2.0 * brakes * wp.abs(left)))
                asked = wp.clamp(left / h, -most, most)
            motors.lacks[a] = asked + motors.lost[a] - u
            motors.to[a] = motors.p[a]
    if round == FURTHER:
        for _ in range(SWEEPS):
            for k in range(m):
                a = motors.which[first + k]
                own = motors.w[motors.block[c] + k * m + k]
                if is_on(a, of, motors) and own > wp.float64(0.0):
                    s = wp.float64(motors.lacks[a])
                    for l in range(m):
                        b = motors.which[first + l]
                        if is_on(b, of, motors):
                            w = motors.w[motors.block[c] + k * m + l]
                            s -= w * wp.float64(motors.to[b] - motors.p[b])
                    most = motors.limit[a] * dt[ties.vert[of.tie[of.first[a]]][0]]
                    motors.to[a] = wp.clamp(motors.to[a] + wp.float32(s / own), -most, most)
    for k in range(m):
        a = motors.which[first + k]
        if is_on(a, of, motors):
            by = answer_of(a, motors.turns[a] != 0, motors.axis[a], motors.at[a], of, d)
            p = motors.to[a] - motors.p[a]
            add_to(by.one, p, by.v_one, by.w_one, motors.by)
            add_to(by.other, p, by.v_other, by.w_other, motors.by)
            motors.p[a] = motors.to[a]


@wp.kernel
def add_motion(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    motors: Motors,
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: add what motors gave its body in this round."""
    i = wp.tid()
    b = d.vert_body[i]
    if d.kind[b] == RIGID and d.inv_total[b] > 0.0:
        v[i] = v[i] + motors.by.v[b] + wp.cross(motors.by.w[b], x[i] - d.centre[b])
