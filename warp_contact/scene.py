"""A scene: bodies of tets with their materials, half-spaces, gravity and friction."""

from dataclasses import dataclass, field

import numpy as np

from warp_contact.mesh import TetMesh


@dataclass(frozen=True, eq=False)
class Body:
    """One deformable body, as placed in the scene.

    Attributes:
        index: its place in the scene
        label: its name, unique in the scene
        mesh: rest shape
        material: constitutive model
        x: initial positions [m], shape (n, 3)
        v: initial velocities [m/s], shape (n, 3)
        fixed: which vertices follow a prescribed velocity, shape (n,), bool
        world: bodies of different worlds never touch
    """

    index: int
    label: str
    mesh: TetMesh
    material: object
    x: np.ndarray = field(repr=False)
    v: np.ndarray = field(repr=False)
    fixed: np.ndarray = field(repr=False)
    world: int


class Scene:
    """Bodies and half-spaces under gravity.

    Attributes:
        gravity: acceleration [m/s^2]
        friction: Coulomb coefficient of every contact [-]
        bodies: in the order in which they were added
        planes: (outward unit normal, offset along it [m]) of each half-space
    """

    def __init__(self, gravity=(0.0, 0.0, -9.81), friction: float = 0.3):
        """Raises ValueError for a gravity that is not three numbers or a negative friction."""
        self.gravity = tuple(_numbers(gravity, (3,), "gravity").tolist())
        self.friction = float(_numbers(friction, (), "friction"))
        if self.friction < 0.0:
            raise ValueError(f"friction {friction} is negative")
        self.bodies: list[Body] = []
        self._labels: set[str] = set()
        self.planes: list[tuple[np.ndarray, float]] = []

    def add_body(
        self,
        mesh: TetMesh,
        material,
        position=(0.0, 0.0, 0.0),
        rotation=(0.0, 0.0, 0.0, 1.0),
        velocity=(0.0, 0.0, 0.0),
        fixed=None,
        label: str | None = None,
        world: int = 0,
    ) -> Body:
        """Place a copy of a rest shape: x = R vertices + position.

        Args:
            mesh: rest shape
            material: constitutive model, such as ``NeoHookean``
            position: translation [m]
            rotation: quaternion (x, y, z, w), normalised here
            velocity: of all vertices, shape (3,), or of each, shape (n, 3) [m/s]
            fixed: True, a mask of shape (n,) or vertex ids: these follow their own velocity
                whatever pushes them
            label: name, unique in the scene; by default ``body<index>``
            world: bodies of different worlds never touch

        Raises:
            ValueError: naming the body, for input that cannot be simulated
        """
        label = f"body{len(self.bodies)}" if label is None else str(label)
        if label in self._labels:
            raise ValueError(f"body '{label}': another body has this label")
        try:
            if not isinstance(mesh, TetMesh):
                raise ValueError(f"mesh is a {type(mesh).__name__}, not a TetMesh")
            material.check()
            n = len(mesh.vertices)
            turn = rotation_matrix(rotation)
            x = mesh.vertices @ turn.T + _numbers(position, (3,), "position")
            v = np.broadcast_to(_velocity(velocity, n), (n, 3)).copy()
            mask = _mask(fixed, n)
            if int(world) != world or world < 0:
                raise ValueError(f"world {world} is not a count")
        except (ValueError, AttributeError) as error:
            raise ValueError(f"body '{label}': {error}") from None
        body = Body(len(self.bodies), label, mesh, material, x, v, mask, int(world))
        self.bodies.append(body)
        self._labels.add(label)
        return body

    def add_plane(self, normal, offset: float = 0.0) -> None:
        """Keep every body in the half-space normal . x >= offset [m]."""
        n = _numbers(normal, (3,), "plane normal")
        length = float(np.linalg.norm(n))
        if length == 0.0:
            raise ValueError("plane normal is zero")
        self.planes.append((n / length, float(_numbers(offset, (), "plane offset"))))


def rotation_matrix(quaternion) -> np.ndarray:
    """Rotation of a quaternion (x, y, z, w) of any length above zero, shape (3, 3)."""
    q = _numbers(quaternion, (4,), "rotation")
    length = float(np.linalg.norm(q))
    if length == 0.0:
        raise ValueError("rotation is a zero quaternion")
    x, y, z, w = q / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _numbers(value, shape: tuple, name: str) -> np.ndarray:
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} {value!r} is not a number") from None
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{name} {value!r} is not finite or not of shape {shape}")
    return array


def _velocity(velocity, n: int) -> np.ndarray:
    shape = (n, 3) if np.ndim(velocity) == 2 else (3,)
    return _numbers(velocity, shape, "velocity")


def _mask(fixed, n: int) -> np.ndarray:
    mask = np.zeros(n, dtype=bool)
    if fixed is None or fixed is False:
        return mask
    if fixed is True:
        return ~mask
    fixed = np.asarray(fixed)
    if fixed.dtype == bool:
        if fixed.shape != (n,):
            raise ValueError(f"fixed has shape {fixed.shape}, the mesh has {n} vertices")
        return fixed.copy()
    if fixed.size and not np.issubdtype(fixed.dtype, np.integer):
        raise ValueError("fixed is neither True, nor a mask, nor vertex ids")
    ids = fixed.astype(np.int64).ravel()
    if ids.size and (ids.min() < 0 or ids.max() >= n):
        raise ValueError(f"fixed names vertex {ids[(ids < 0) | (ids >= n)][0]} of {n}")
    mask[ids] = True
    return mask
