"""Joints of a Newton model: those that are held are attachments; forces along them."""

import newton
import numpy as np
from newton import JointType, Model

from warp_contact.newton.refusals import JOINTS, holding, kinematic, numbers
from warp_contact.scene.body import Body
from warp_contact.scene.scene import Scene, rotation_matrix

OPEN = 1e-3  # of the radius of the child, and [rad]: how far a joint may be apart at the start


def start_poses(model: Model) -> np.ndarray:
    """``body_q`` of the model where its joints hold, else as ``joint_q`` has it, shape (n, 7).

    Raises:
        ValueError: naming a joint that holds in neither
    """
    q = numbers(model.body_q)
    if _first_open(model, q) is None:
        return q
    state = model.state()
    newton.eval_fk(model, model.joint_q, model.joint_qd, state)
    q = numbers(state.body_q)
    if (k := _first_open(model, q)) is not None:
        where = "neither with model.body_q nor with model.joint_q"
        raise ValueError(f"joint '{model.joint_label[k]}' is closed {where}: correct one of them")
    return q


def attach(model: Model, scene: Scene, bodies: dict[int, Body], q: np.ndarray) -> None:
    """Hold bodies, which lie at ``q``, as the joints do.

    Args:
        model: with joints
        scene: with the bodies
        bodies: of the scene, by their number in the model
        q: their poses [m], shape (n, 7)
    """
    driven = np.append(kinematic(model), True)  # the last one is -1, the world
    for k in np.flatnonzero(holding(model)):
        parent, child = int(model.joint_parent.numpy()[k]), int(model.joint_child.numpy()[k])
        if driven[parent] and driven[child]:
            continue
        kind = JOINTS[JointType(int(model.joint_type.numpy()[k]))]
        (_, turn), (at, _) = _frames(model, q, k)
        line = turn @ _axes(model, k)[0] if kind in ("hinge", "slider") else None
        label = f"joint {k} '{model.joint_label[k]}'"
        scene.attach(bodies[child], bodies.get(parent), kind, at=at, axis=line, label=label)


def attach_particles(model: Model, scene: Scene, soft: dict[int, tuple[Body, int]], bodies, q):
    """Hold particles at rigid bodies by springs, or hard where their stiffness is infinite.

    Args:
        model: with attachments
        scene: with the bodies
        soft: of each particle its body and the number of its vertex there
        bodies: rigid ones, by their number in the model
        q: their poses [m], shape (n, 7)

    Raises:
        ValueError: naming one that is damped, or apart from the start
    """
    names = "particle", "body", "body_point", "stiffness", "damping", "enabled"
    rows = [numbers(getattr(model, f"attachment_particle_body_{name}")) for name in names]
    for k, (i, b, point, stiffness, damping, enabled) in enumerate(zip(*rows, strict=True)):
        if not enabled:
            continue
        label = f"attachment {k}"
        if int(i) not in soft:
            raise ValueError(f"{label} of particle {i}, which is of no tet: take it out")
        (body, vertex), solid = soft[int(i)], bodies[int(b)]
        if damping and np.isfinite(stiffness):
            wanted = "springs are damped by the steps alone here; set it to zero"
            raise ValueError(f"{label} of particle {i} has a damping: {wanted}")
        apart = np.linalg.norm(_place(q[b], point) - body.x[vertex])
        if apart > OPEN * _size(model, int(b)):
            wanted = "begin with the body_point where the particle is"
            raise ValueError(f"{label} of particle {i} is {apart:.3g} m apart: {wanted}")
        if not (body.fixed[vertex] and solid.fixed.all()):
            spring = float(stiffness) if np.isfinite(stiffness) else None
            scene.attach(body, solid, "ball", vertices=[vertex], stiffness=spring, label=label)


def add_joint_forces(model: Model, forces: np.ndarray, q: np.ndarray, wrench: np.ndarray) -> None:
    """Add generalized forces of joints to those on bodies, about their centres of mass.

    Args:
        model: with joints
        forces: ``joint_f`` [N] or [N m], shape (joint_dof_count,)
        q: poses of the bodies [m], shape (n, 7)
        wrench: force [N] and torque [N m] on each body, shape (n, 6); added to
    """
    start, linear = numbers(model.joint_qd_start), numbers(model.joint_dof_dim)
    enabled, kinds = numbers(model.joint_enabled), numbers(model.joint_type)
    for k in np.flatnonzero(enabled):
        own = forces[start[k] : start[k + 1]].astype(np.float64)
        if not own.any():
            continue
        parent, child = int(model.joint_parent.numpy()[k]), int(model.joint_child.numpy()[k])
        if kinds[k] == JointType.FREE:  # along the axes of the world, at the centre of mass
            wrench[child] += own
            continue
        (_, turn), (at, _) = _frames(model, q, k)
        axes, n = _axes(model, k) @ turn.T, linear[k, 0]
        push, twist = own[:n] @ axes[:n], own[n:] @ axes[n:]
        for body, sign in ((child, 1.0), (parent, -1.0)):
            if body >= 0:
                centre = _place(q[body], model.body_com.numpy()[body])
                torque = twist + np.cross(at - centre, push)
                wrench[body] += sign * np.concatenate([push, torque])


def _first_open(model: Model, q: np.ndarray) -> int | None:
    """A joint that is not closed with the bodies at ``q``, None if all are."""
    for k in np.flatnonzero(holding(model)):
        (a, turn_a), (b, turn_b) = _frames(model, q, k)
        kind = JOINTS[JointType(int(model.joint_type.numpy()[k]))]
        apart, turned = b - a, turn_a.T @ turn_b - np.eye(3)
        if kind in ("hinge", "slider"):
            axis = _axes(model, k)[0]
            if kind == "hinge":
                turned = turned @ axis
            else:
                line = turn_a @ axis
                apart = apart - line * (line @ apart)
        if np.linalg.norm(apart) > OPEN * _size(model, _child(model, k)) or (
            kind != "ball" and np.abs(turned).max() > OPEN
        ):
            return int(k)
    return None


def _size(model: Model, b: int) -> float:
    """Radius [m] of the largest shape of a body."""
    return float(numbers(model.shape_collision_radius)[model.body_shapes[b]].max())


def _child(model: Model, k: int) -> int:
    return int(model.joint_child.numpy()[k])


def _axes(model: Model, k: int) -> np.ndarray:
    """Of each degree of freedom, in the frame of the joint at the parent, shape (n, 3)."""
    start = numbers(model.joint_qd_start)
    return numbers(model.joint_axis)[start[k] : start[k + 1]].astype(np.float64)


def _frames(model: Model, q: np.ndarray, k: int):
    """Place [m] and rotation of joint ``k`` as the parent has it, and as the child has it."""
    ends = int(model.joint_parent.numpy()[k]), _child(model, k)
    out = []
    for body, place in zip(ends, (model.joint_X_p, model.joint_X_c), strict=True):
        local = place.numpy()[k].astype(np.float64)
        at, turn = local[:3], rotation_matrix(local[3:])
        if body >= 0:
            at, turn = _place(q[body], at), rotation_matrix(q[body, 3:].astype(np.float64)) @ turn
        out.append((at, turn))
    return out


def _place(q: np.ndarray, point: np.ndarray) -> np.ndarray:
    """A point of a body's frame in the world [m]."""
    q = q.astype(np.float64)
    return rotation_matrix(q[3:]) @ point + q[:3]
