"""A scene: bodies of tets with their materials, half-spaces, gravity, friction, restitution."""

import re
from numbers import Integral

import numpy as np

from warp_contact import checks
from warp_contact.scene import attachments, from_usd, placement
from warp_contact.scene.attachments import Attachment
from warp_contact.scene.body import Body
from warp_contact.scene.materials import Rigid
from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.surface import Surface
from warp_contact.scene.topology import HUGE

PLANE = re.compile(r"plane\d+")  # names of half-spaces in measurements
COEFFICIENTS = {"friction": (0.0, checks.LARGEST), "restitution": (0.0, 1.0)}  # least, most


class Scene:
    """Bodies and half-spaces under gravity.

    Attributes:
        gravity: acceleration [m/s^2]
        friction: Coulomb coefficient of bodies and half-spaces without one of their own [-];
            between two of them the mean of theirs counts
        restitution: the same of restitution, 0 to 1 [-]
        bodies: in the order in which they were added
        planes: (outward unit normal, offset along it [m]) of each half-space
        plane_friction, plane_restitution: the coefficients of each half-space, None for that of the
            scene
        attachments: what holds bodies at each other, in the order in which they were added
        not_read: what a USD stage holds and ``from_usd`` did not read or had to assume, in words
    """

    def __init__(self, gravity=(0.0, 0.0, -9.81), friction: float = 0.3, restitution: float = 0.0):
        """Raises ValueError for a gravity that is not three numbers or a wrong coefficient."""
        self.gravity = gravity
        self.friction, self.restitution = friction, restitution
        self.bodies: list[Body] = []
        self._labels: set[str] = set()
        self.planes: list[tuple[np.ndarray, float]] = []
        self.plane_friction: list[float | None] = []
        self.plane_restitution: list[float | None] = []
        self.attachments: list[Attachment] = []
        self.not_read: list[str] = []

    @classmethod
    def from_usd(cls, path, at: str | float = "start", material=None) -> "Scene":
        """Read the tets of a USD stage and their physics: what a ``UsdWriter`` wrote, or others.

        Each TetMesh is a body, or those together that are below one ``PhysicsRigidBodyAPI``. Taken
        are rest shapes, transforms, materials, masses, velocities, what is kinematic or held,
        planes that collide and gravity, in units and axes of the stage. ``not_read`` lists the
        rest; where that is physics, a warning says so.

        Args:
            path: a file, or the folder of a ``UsdWriter``
            at: ``start``; ``last`` or the number of a frame takes positions and velocities there,
                for bodies that deform as far as ``UsdWriter(animate_tets=True, velocities=True)``
                has written them
            material: of bodies that deform and have no Young's modulus in the stage

        Raises:
            OSError: there is no such file
            ValueError: it is damaged or holds no TetMesh, a body cannot be simulated, or has no
                material; the inner vertices of one were not written
        """
        scene = cls()
        from_usd.fill(scene, path, at, material)
        return scene

    def __setattr__(self, name: str, value) -> None:
        """Raises ValueError for a scene that a simulation has taken over, or a wrong value."""
        self._refuse_if_frozen(name)
        if name == "gravity":
            value = tuple(checks.numbers(value, (3,), name).tolist())
        elif name in COEFFICIENTS:
            value = checks.number(value, name, *COEFFICIENTS[name])
        super().__setattr__(name, value)

    def freeze(self) -> None:
        """Let nothing be changed or added from now on: a simulation does not see it."""
        if "_frozen" not in vars(self):
            for name, value in list(vars(self).items()):
                if isinstance(value, list) and name != "not_read":
                    setattr(self, name, tuple(value))
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
        angular_velocity=(0.0, 0.0, 0.0),
        friction: float | None = None,
        render: Surface | None = None,
        restitution: float | None = None,
    ) -> Body:
        """Place a copy of a rest shape: x = R vertices + position.

        Args:
            mesh: rest shape
            material: constitutive model, such as ``NeoHookean``
            position: translation [m]
            rotation: quaternion (x, y, z, w), normalised here
            velocity: of all vertices, shape (3,), or of each, shape (n, 3) [m/s]
            fixed: True, mask (n,) or ids, all of a rigid body: they follow their own velocity
            label: name, unique in the scene and no ``plane<index>``; by default ``body<index>``
            world: bodies of different worlds never touch
            angular_velocity: about the centre of mass, on top of ``velocity`` [rad/s]
            render: surface to draw, in the frame of the mesh, which follows its tets
            friction: Coulomb coefficient, in place of that of the scene
            restitution: the same of restitution, 0 to 1

        Raises:
            ValueError: naming the body, for input that cannot be simulated
        """
        label = self.new_label(label)
        try:
            placement.check_given(mesh, material, label, render)
            own = _given("friction", friction), _given("restitution", restitution)
            start = _start(mesh, material, (position, rotation), velocity, angular_velocity, fixed)
            placed = mesh, material, *start, checks.count(world, "world", least=0)
        except (ValueError, TypeError, AttributeError) as error:
            raise ValueError(f"body '{label}': {error}") from None
        self.bodies.append(body := Body(len(self.bodies), label, *placed, *own, render))
        self._labels.add(label)
        return body

    def new_label(self, label: str | None) -> str:
        """A label that no body has; raises ValueError for one that is taken or that of a plane."""
        self._refuse_if_frozen("a body")
        label = f"body{len(self.bodies)}" if label is None else checks.label(label, "label")
        if label in self._labels:
            raise ValueError(f"body '{label}': another body has this label")
        if PLANE.fullmatch(label):
            raise ValueError(f"body '{label}': this is how a half-space is called")
        return label

    def add_plane(
        self,
        normal,
        offset: float = 0.0,
        friction: float | None = None,
        restitution: float | None = None,
    ) -> None:
        """Keep every body in the half-space normal . x >= offset [m]; coefficients as of a body."""
        self._refuse_if_frozen("a plane")
        n = _unit(checks.numbers(normal, (3,), "plane normal"), "plane normal")
        offset = checks.number(offset, "plane offset", -HUGE, HUGE)
        friction, restitution = _given("friction", friction), _given("restitution", restitution)
        self.planes.append((n, offset))
        self.plane_friction.append(friction)
        self.plane_restitution.append(restitution)

    def coefficients(self, name: str) -> list[float]:
        """``friction`` or ``restitution`` of each body, then of each plane."""
        of_bodies = [getattr(body, name) for body in self.bodies]
        own = [*of_bodies, *getattr(self, f"plane_{name}")]
        return [getattr(self, name) if c is None else c for c in own]

    def attach(
        self,
        a: Body | int | str,
        b: Body | int | str | None = None,
        kind: str = "weld",
        at=None,
        vertices=None,
        axis=None,
        stiffness: float | None = None,
        breaking_force: float | None = None,
        label: str | None = None,
    ) -> Attachment:
        """Hold a body at another one, as they are placed; the two do not touch each other.

        Args:
            a: the body, its index or its label
            b: the other one; None for the world
            kind: ``weld`` lets nothing move; ``ball`` holds a point, ``hinge`` an axis, along a
                ``slider`` a moves straight
            at: the point of a ball, or where the axis is [m]; of a weld of rigid bodies, by default
                the middle of a
            vertices: mask or ids of the vertices of a that are held, instead: one of a ball, three
                or more of a weld. A body that deforms is welded by its vertices
            axis: direction of a hinge or a slider, both of rigid bodies
            stiffness: of springs in place of a hard hold, all points together [N/m]
            breaking_force: sum of the forces of all points above which it breaks for good [N]
            label: name, unique among attachments; by default ``attachment<index>``

        Raises:
            ValueError: naming the attachment, for what holds nothing
        """
        self._refuse_if_frozen("an attachment")
        label = f"attachment{len(self.attachments)}" if label is None else label
        label = checks.label(label, "label")
        if any(label == other.label for other in self.attachments):
            raise ValueError(f"attachment '{label}': another one has this label")
        try:
            bodies = self._body(a), None if b is None else self._body(b)
            given = at, vertices, axis, stiffness, breaking_force
            made = attachments.make(len(self.attachments), label, *bodies, kind, *given)
        except ValueError as error:
            raise ValueError(f"attachment '{label}': {error}") from None
        self.attachments.append(made)
        return made

    def _body(self, of) -> Body:
        """The body that is meant; raises ValueError where there is none."""
        if isinstance(of, Integral) and not isinstance(of, bool | np.bool_):
            of = self.bodies[int(of)] if 0 <= int(of) < len(self.bodies) else of
        for body in self.bodies:
            if of is body or (isinstance(of, str) and of == body.label):
                return body
        raise checks.refuse("body", of, "a body of this scene, its label or its index")


def rotation_matrix(quaternion) -> np.ndarray:
    """Rotation of a quaternion (x, y, z, w) of any length above zero, shape (3, 3)."""
    x, y, z, w = _unit(checks.numbers(quaternion, (4,), "rotation"), "rotation")
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _given(name: str, value) -> float | None:
    return None if value is None else checks.number(value, name, *COEFFICIENTS[name])


def _unit(vector: np.ndarray, name: str) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    if length < checks.SMALLEST:
        raise checks.refuse(name, vector.tolist(), "numbers that are not all zero")
    return vector / length


def _start(
    mesh: TetMesh, material, place: tuple, velocity, angular_velocity, fixed
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions [m], velocities [m/s] and which of them are fixed, of the vertices of a mesh."""
    x = _placed(mesh.vertices, *place)
    v = _velocities(mesh, material, x, place, velocity, angular_velocity)
    return x, v, _mask(fixed, len(x), isinstance(material, Rigid), angular_velocity)


def _placed(points: np.ndarray, position, rotation) -> np.ndarray:
    turn = rotation_matrix(rotation)
    return points @ turn.T + checks.numbers(position, (3,), "position", HUGE)


def _velocities(
    mesh: TetMesh, material, x: np.ndarray, place: tuple, velocity, angular_velocity
) -> np.ndarray:
    """Velocities [m/s] of vertices at ``x``, shape (n, 3), of a mesh at a position and rotation."""
    v = checks.vectors(velocity, len(x), "velocity", checks.FASTEST)
    w = checks.numbers(angular_velocity, (3,), "angular_velocity", HUGE)
    if isinstance(material, Rigid):
        centre = _placed(material.solid(mesh.vertices, mesh.tets).centre, *place)
    else:
        mass = np.bincount(mesh.tets.ravel(), np.repeat(mesh.volumes, 4), len(x))
        centre = np.average(x, axis=0, weights=mass)
    v = v + np.cross(w, x - centre)
    return checks.vectors(v, len(x), "velocity", checks.FASTEST)


def _mask(fixed, n: int, rigid: bool, angular_velocity) -> np.ndarray:
    """Which of ``n`` vertices are fixed, shape (n,); raises ValueError where some may not be."""
    mask = np.zeros(n, dtype=bool)
    if isinstance(fixed, bool | np.bool_):
        mask |= fixed
    elif fixed is not None:
        mask[checks.vertex_ids(fixed, n, "fixed")] = True
    if rigid and mask.any() and not mask.all():
        raise checks.refuse("fixed", fixed, "True or None for a rigid body")
    if mask.any() and np.any(angular_velocity):
        wanted = "zero where vertices are fixed: these go straight, give them targets"
        raise checks.refuse("angular_velocity", angular_velocity, wanted)
    return mask
