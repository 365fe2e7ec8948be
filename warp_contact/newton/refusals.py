"""What of a Newton model the solver cannot simulate is refused, by its name."""

import numpy as np
from newton import BodyFlags, JointType, Model, ParticleFlags

SKIN = 3  # stiffness of area and shape, and damping, of a triangle; then drag and lift


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
    counts |= {"attachment_particle_body_count": "attachments of particles"}
    for name, what in counts.items():
        if getattr(model, name):
            raise ValueError(f"the model has {getattr(model, name)} {what}: take them out")
    _refuse_skins(model)
    _refuse_joints(model)
    _refuse_loose(model)


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
    bad = np.flatnonzero((kind != JointType.FREE) | (parent != -1))
    if len(bad):
        first = bad[0]
        label, name = model.joint_label[first], JointType(int(kind[first])).name
        raise ValueError(f"joint '{label}' ({name}): bodies move freely here, without joints")


def _refuse_loose(model: Model) -> None:
    """Particles that move, but belong to no tet."""
    moves = (numbers(model.particle_mass) > 0.0) & active(model)
    moves[model.tet_indices.numpy().ravel()] = False
    if moves.any():
        ids = np.flatnonzero(moves)
        raise ValueError(f"particles {some(ids)} belong to no tet: cloth and grains are left out")


def active(model: Model) -> np.ndarray:
    """Which particles move unless they have no mass, shape (n,)."""
    return (numbers(model.particle_flags).astype(int) & int(ParticleFlags.ACTIVE)) != 0


def kinematic(model: Model) -> np.ndarray:
    """Which bodies go where the user puts them, shape (n,)."""
    flags = numbers(model.body_flags).astype(int)
    return (flags & int(BodyFlags.KINEMATIC) != 0) | (numbers(model.body_mass) == 0.0)
