"""A scene: bodies of tets with their materials, half-spaces, gravity and friction."""

import re
from dataclasses import dataclass, field
from numbers import Integral

import numpy as np

from warp_contact.scene.mesh import TetMesh

PLANE = re.compile(r"plane\d+")  # names of half-spaces in measurements


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
        self.gravity = tuple(numbers(gravity, (3,), "gravity").tolist())
        self.friction = float(numbers(friction, (), "friction"))
        if self.friction < 0.0:
            raise ValueError(f"friction {friction} is negative")
        self.bodies: list[Body] | tuple[Body, ...] = []
        self._labels: set[str] = set()
        self.planes: list[tuple[np.ndarray, float]] | tuple = []

    def __setattr__(self, name: str, value) -> None:
        """Raises ValueError for a scene that a simulation has taken over."""
        self._refuse_if_frozen(name)
        super().__setattr__(name, value)

    def freeze(self) -> None:
        """Let nothing be changed or added from now on: a simulation does not see it."""
        if "_frozen" not in vars(self):
            self.bodies, self.planes = tuple(self.bodies), tuple(self.planes)
            self._frozen = True

    def _refuse_if_frozen(self, what: str) -> None:
        if "_frozen" in vars(self):
            after = "after a Simulation was made of the scene; build another scene"
            raise ValueError(f"{what} cannot be changed or added {after}")

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
            label: name, unique in the scene and no ``plane<index>``; by default ``body<index>``
            world: bodies of different worlds never touch

        Raises:
            ValueError: naming the body, for input that cannot be simulated
        """
        label = self._new_label(label)
        try:
            if not isinstance(mesh, TetMesh):
                raise ValueError(f"mesh is a {type(mesh).__name__}, not a TetMesh")
            material.check()
            n = len(mesh.vertices)
            turn = rotation_matrix(rotation)
            x = mesh.vertices @ turn.T + numbers(position, (3,), "position")
            v = np.broadcast_to(_velocity(velocity, n), (n, 3)).copy()
            mask = _mask(fixed, n)
            if not isinstance(world, Integral) or world < 0:
                raise ValueError(f"world {world} is not a count")
        except (ValueError, TypeError, AttributeError) as error:
            raise ValueError(f"body '{label}': {error}") from None
        body = Body(len(self.bodies), label, mesh, material, x, v, mask, int(world))
        self.bodies.append(body)
        self._labels.add(label)
        return body

    def _new_label(self, label: str | None) -> str:
        """A label that no body has; raises ValueError for one that is taken or that of a plane."""
        self._refuse_if_frozen("a body")
        label = f"body{len(self.bodies)}" if label is None else str(label)
        if label in self._labels:
            raise ValueError(f"body '{label}': another body has this label")
        if PLANE.fullmatch(label):
            raise ValueError(f"body '{label}': this is how a half-space is called")
        return label

    def add_plane(self, normal, offset: float = 0.0) -> None:
        """Keep every body in the half-space normal . x >= offset [m]."""
        self._refuse_if_frozen("a plane")
        n = numbers(normal, (3,), "plane normal")
        length = float(np.linalg.norm(n))
        if length == 0.0:
            raise ValueError("plane normal is zero")
        self.planes.append((n / length, float(numbers(offset, (), "plane offset"))))


def rotation_matrix(quaternion) -> np.ndarray:
    """Rotation of a quaternion (x, y, z, w) of any length above zero, shape (3, 3)."""
    q = numbers(quaternion, (4,), "rotation")
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


def numbers(value, shape: tuple, name: str) -> np.ndarray:
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} {value!r} is not a number") from None
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{name} {value!r} is not finite or not of shape {shape}")
    return array


def _velocity(velocity, n: int) -> np.ndarray:
    shape = (n, 3) if np.ndim(velocity) == 2 else (3,)
    return numbers(velocity, shape, "velocity")


def _mask(fixed, n: int) -> np.ndarray:
    mask = np.zeros(n, dtype=bool)
    if fixed is None or fixed is False:
        return mask
    if fixed is True:
        return ~mask
    mask[vertex_ids(fixed, n, "fixed")] = True
    return mask


def vertex_ids(chosen, n: int, name: str) -> np.ndarray:
    """Ids that a mask of ``n`` vertices, or a list of ids, chooses; ``name`` is for the errors."""
    chosen = np.asarray(chosen)
    if chosen.dtype == bool:
        if chosen.shape != (n,):
            raise ValueError(f"{name} has shape {chosen.shape}, there are {n} vertices")
        return np.flatnonzero(chosen)
    if chosen.size and not np.issubdtype(chosen.dtype, np.integer):
        raise ValueError(f"{name}: neither a mask nor vertex ids")
    ids = chosen.astype(np.int64).ravel()
    wrong = ids[(ids < 0) | (ids >= n)]
    if wrong.size:
        raise ValueError(f"{name} names vertex {wrong[0]} of {n}")
    return ids
