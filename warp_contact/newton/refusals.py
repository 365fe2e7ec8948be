"""What of a Newton model the solver cannot simulate is refused, by its name."""

import numpy as np
from newton import MAXVAL, BodyFlags, JointType, Model, ParticleFlags, ShapeFlags, State

SKIN = 3  # stiffness of area and shape, and damping, of a triangle; then drag and lift
JOINTS = {
    JointType.FIXED: "weld",
    JointType.BALL: "ball",
    JointType.REVOLUTE: "hinge",
    JointType.PRISMATIC: "slider",
}
DRIVES = (
    "joint_target_ke",
    "joint_target_kd",
    "joint_stiffness",
    "joint_damping",
    "joint_friction",
    "joint_armature",
)


def numbers(array) -> np.ndarray:
    """A Warp array of a model as it is on the host, empty for None."""
    return np.zeros(0) if array is None else array.numpy()


def some(ids: np.ndarray) -> str:
    """The first few of many numbers."""
    return ", ".join(map(str, ids[:5].tolist())) + (", ..." if len(ids) > 5 else "")


def refuse(model: Model) -> None:
    """Raise ValueError for what would be left out silently."""
    if model.requires_grad:
        raise ValueError("requires_grad: this solver has no gradients; finalize() without it")
    if not model.tet_count:
        raise ValueError("the model has no tets: this solver is for soft bodies of tets")
    counts = {"spring_count": "springs", "muscle_count": "muscles"}
    counts |= {"tendon_count": "tendons", "constraint_mimic_count": "mimic constraints"}
    for name, what in counts.items():
        if getattr(model, name):
            raise ValueError(f"the model has {getattr(model, name)} {what}: take them out")
    proxies = numbers(model.particle_flags).astype(int) & int(ParticleFlags.PROXY)
    if proxies.any():
        ids = some(np.flatnonzero(proxies))
        wanted = "their tets would have forces twice; let this solver own all soft bodies of tets"
        raise ValueError(f"particles {ids} of another solver cannot be proxies here: {wanted}")
    _refuse_skins(model)
    _refuse_joints(model)
    _refuse_loose(model)
    _refuse_settings(model)
    _refuse_shapes(model)
    _refuse_pairs(model)


def _refuse_skins(model: Model) -> None:
    given = {
        "tri_materials": numbers(model.tri_materials).reshape(-1, 5)[:, :SKIN],
        "edge_bending_properties": numbers(model.edge_bending_properties).reshape(-1, 2),
        "tet_activations": numbers(model.tet_activations).reshape(-1, 1),
    }
    for name, values in given.items():
        at = np.flatnonzero(values.any(axis=1))
        if len(at):
            wanted = "only tets have forces here; set them to zero"
            raise ValueError(f"{name} of {some(at)} is not zero: {wanted}")


def _refuse_joints(model: Model) -> None:
    kind, parent = numbers(model.joint_type), numbers(model.joint_parent)
    free = kind == JointType.FREE
    known = np.isin(kind, [int(k) for k in JOINTS]) & (numbers(model.joint_mimic_joint) < 0)
    bad = np.flatnonzero(np.where(free, parent != -1, holding(model) & ~known))
    if len(bad):
        first = bad[0]
        label, name = model.joint_label[first], JointType(int(kind[first])).name
        known = "joints to the world that are free, and fixed, ball, revolute and prismatic ones"
        raise ValueError(f"joint '{label}' ({name}): here are {known}, which follow no other")
    for name in DRIVES:
        _refuse_at(model, name, numbers(getattr(model, name)) != 0.0, "is not zero")
    _refuse_at(model, "joint_limit_lower", numbers(model.joint_limit_lower) > -MAXVAL, "is set")
    _refuse_at(model, "joint_limit_upper", numbers(model.joint_limit_upper) < MAXVAL, "is set")


def _refuse_at(model: Model, name: str, bad: np.ndarray, what: str) -> None:
    """Raise ValueError for a degree of freedom with something that is not simulated."""
    start = numbers(model.joint_qd_start)
    of = np.repeat(np.arange(model.joint_count), np.diff(start[: model.joint_count + 1]))
    at = np.flatnonzero(bad & numbers(model.joint_enabled).astype(bool)[of])
    if len(at):
        wanted = "joints have no drives, springs, friction, armature or limits here; take it out"
        raise ValueError(f"{name} of joint '{model.joint_label[of[at[0]]]}' {what}: {wanted}")


def _refuse_loose(model: Model) -> None:
    """Particles that move, but belong to no tet."""
    moves = (numbers(model.particle_mass) > 0.0) & active(model)
    moves[model.tet_indices.numpy().ravel()] = False
    if moves.any():
        ids = np.flatnonzero(moves)
        raise ValueError(f"particles {some(ids)} belong to no tet: cloth and grains are left out")


def _refuse_settings(model: Model) -> None:
    """Of the model as a whole, where they are not as Newton sets them."""
    for name in "soft_contact_restitution", "particle_adhesion", "particle_cohesion":
        if getattr(model, name):
            value = getattr(model, name)
            raise ValueError(f"{name} is {value:g}: contacts have none here; set it to zero")
    asked = sorted(
        {*model.get_requested_state_attributes()} & {*State.EXTENDED_ATTRIBUTE_TEMPLATES}
    )
    if asked:
        wanted = "ask the solver for observables"
        raise ValueError(f"state attributes {', '.join(asked)} are not written here: {wanted}")
    chosen = np.flatnonzero(numbers(model.body_variant) >= 0)
    if len(chosen):
        raise ValueError(f"bodies {some(chosen)} have variants: build a model of those chosen")


def collides(model: Model) -> np.ndarray:
    """Which shapes touch particles or other shapes, shape (n,)."""
    both = int(ShapeFlags.COLLIDE_PARTICLES) | int(ShapeFlags.COLLIDE_SHAPES)
    return numbers(model.shape_flags).astype(int) & both != 0


def _refuse_shapes(model: Model) -> None:
    """Shapes that collide in a way that bodies have not here."""
    shapes = collides(model)
    given = {
        "shape_margin": "they touch where their surfaces are",
        "shape_material_ka": "nothing sticks",
        "shape_material_restitution": "contacts have none",
    }
    for name, what in given.items():
        at = np.flatnonzero(shapes & (numbers(getattr(model, name)) != 0.0))
        if len(at):
            raise ValueError(
                f"{name} of shapes {some(at)} is not zero: here {what}; set it to zero"
            )
    belts = [getattr(source, "enable_surface_velocity", False) for source in model.shape_source]
    at = np.flatnonzero(shapes & np.array(belts, dtype=bool))
    if len(at):
        raise ValueError(f"shapes {some(at)} have a surface velocity: move a kinematic body")
    flags = numbers(model.shape_flags).astype(int)
    at = np.flatnonzero(shapes & (flags & int(ShapeFlags.COLLIDE_PARTICLES) == 0))
    if len(at):
        wanted = "what collides here touches soft bodies too; let it collide with nothing, or both"
        raise ValueError(f"shapes {some(at)} do not collide with particles: {wanted}")


def _refuse_pairs(model: Model) -> None:
    """Shapes that touch here and not in Newton, by its groups and filters, or the other way."""
    if not model.shape_count:
        return
    n = model.shape_count
    pairs = np.sort(numbers(model.shape_contact_pairs).reshape(-1, 2).astype(np.int64), axis=1)
    theirs = pairs[_may_touch(model, *pairs.T)] @ [n, 1]
    worlds = numbers(model.shape_world)
    ours = []
    for world in np.unique(worlds):
        own = np.flatnonzero(collides(model) & ((worlds == world) | (worlds == -1)))
        i, j = own[np.array(np.triu_indices(len(own), 1))]
        ours.append((i * n + j)[_may_touch(model, i, j) & ~_joined(model, i, j)])
    ours = np.unique(np.concatenate(ours))
    for codes, what in (
        (
            np.setdiff1d(ours, theirs),
            "do not touch in this model, by group or filter: here they do",
        ),
        (
            np.setdiff1d(theirs, ours),
            "touch in this model, and are of bodies with a joint: here not",
        ),
    ):
        if len(codes):
            i, j = divmod(int(codes[0]), n)
            names = f"shapes {i} '{model.shape_label[i]}' and {j} '{model.shape_label[j]}'"
            raise ValueError(f"{names} {what}; let all touch but those of bodies with a joint")


def _may_touch(model: Model, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Which pairs of shapes are of two bodies, one of which is moved by forces, shape (n,)."""
    body = numbers(model.shape_body)
    moves = np.append(~kinematic(model), False)  # the last one is -1, the world
    return (body[i] != body[j]) & (moves[body[i]] | moves[body[j]])


def _joined(model: Model, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Which pairs of shapes are of two bodies with a joint, shape (n,)."""
    body, n = numbers(model.shape_body).astype(np.int64), model.body_count
    holds = holding(model)
    ends = np.stack([numbers(model.joint_parent), numbers(model.joint_child)]).astype(np.int64)
    low, high = np.sort(ends[:, holds & (ends[0] >= 0)], axis=0)
    first, second = np.sort([body[i], body[j]], axis=0)
    return np.isin(first * n + second, low * n + high)  # below zero with the world


def holding(model: Model) -> np.ndarray:
    """Which joints hold their two bodies together, shape (n,)."""
    enabled = numbers(model.joint_enabled).astype(bool)
    return enabled & (numbers(model.joint_type) != JointType.FREE)


def active(model: Model) -> np.ndarray:
    """Which particles move unless they have no mass, shape (n,)."""
    return (numbers(model.particle_flags).astype(int) & int(ParticleFlags.ACTIVE)) != 0


def kinematic(model: Model) -> np.ndarray:
    """Which bodies go where the user puts them, shape (n,); so do those fixed to the world."""
    flags = numbers(model.body_flags).astype(int)
    out = (flags & int(BodyFlags.KINEMATIC) != 0) | (numbers(model.body_mass) == 0.0)
    fixed = holding(model) & (numbers(model.joint_type) == JointType.FIXED)
    out[numbers(model.joint_child)[fixed & (numbers(model.joint_parent) == -1)].astype(int)] = True
    return out
