"""A scene: bodies of tets with their materials, half-spaces, gravity and friction."""

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


class Scene:
    """Bodies and half-spaces under gravity.

    Attributes:
        gravity: acceleration [m/s^2]
        friction: Coulomb coefficient of bodies and half-spaces without one of their own [-];
            between two of them the mean of theirs counts
        bodies: in the order in which they were added
        planes: (outward unit normal, offset along it [m]) of each half-space
        plane_friction: the coefficient of each half-space, None for that of the scene
        attachments: what holds bodies at each other, in the order in which they were added
        not_read: what a USD stage holds and ``from_usd`` did not read or had to assume, in words
    """

    def __init__(self, gravity=(0.0, 0.0, -9.81), friction: float = 0.3):
        """Raises ValueError for a gravity that is not three numbers or a negative friction."""
        self.gravity = gravity
        self.friction = friction
        self.bodies: list[Body] = []
        self._labels: set[str] = set()
        self.planes: list[tuple[np.ndarray, float]] = []
        self.plane_friction: list[float | None] = []
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
        elif name == "friction":
            value = checks.number(value, name, least=0.0)
        super().__setattr__(name, value)

    def freeze(self) -> None:
        """Let nothing be changed or added from now on: a simulation does not see it."""
        if "_frozen" not in vars(self):
            for name in ("bodies", "planes", "plane_friction", "attachments"):
                setattr(self, name, tuple(getattr(self, name)))
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
            friction: Coulomb coefficient, in place of that of the scene
            render: surface to draw, in the frame of the mesh, which follows its tets

        Raises:
            ValueError: naming the body, for input that cannot be simulated
        """
        label = self.new_label(label)
        try:
            _check_shape(mesh, material, label, render)
            world, friction = checks.count(world, "world", least=0), _coefficient(friction)
            x = _placed(mesh.vertices, position, rotation)
            v = _velocities(mesh, material, x, (position, rotation), velocity, angular_velocity)
            mask = _mask(fixed, len(x), isinstance(material, Rigid), angular_velocity)
        except (ValueError, TypeError, AttributeError) as error:
            raise ValueError(f"body '{label}': {error}") from None
        placed = mesh, material, x, v, mask, world, friction, render
        self.bodies.append(body := Body(len(self.bodies), label, *placed))
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

    def add_plane(self, normal, offset: float = 0.0, friction: float | None = None) -> None:
        """Keep every body in the half-space normal . x >= offset [m]; ``friction`` as of a body."""
        self._refuse_if_frozen("a plane")
        n = _unit(checks.numbers(normal, (3,), "plane normal"), "plane normal")
        offset = checks.number(offset, "plane offset", -HUGE, HUGE)
        friction = _coefficient(friction)
        self.planes.append((n, offset))
        self.plane_friction.append(friction)

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


def _coefficient(friction) -> float | None:
    return None if friction is None else checks.number(friction, "friction", least=0.0)


def _unit(vector: np.ndarray, name: str) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    if length < checks.SMALLEST:
        raise checks.refuse(name, vector.tolist(), "numbers that are not all zero")
    return vector / length


def _check_shape(mesh, material, label: str, render) -> None:
    """Raises ValueError for what is no mesh, material or render surface, or a class not called."""
    if not isinstance(mesh, TetMesh):
        such = "wc.shell(surface, 0.01)" if isinstance(mesh, Surface) else "wc.box(0.1, 2)"
        raise checks.refuse("mesh", mesh, f"a TetMesh, such as {such}")
    if isinstance(material, type) or not callable(getattr(material, "check", None)):
        wanted = "a material, such as wc.NeoHookean(1e5, 0.4, 1000.0)"
        raise checks.refuse("material", material, wanted)
    material.check()
    placement.check_shape(mesh, label)
    if render is not None:
        _check_render(render, mesh)


def _check_render(render, mesh: TetMesh) -> None:
    """Raises ValueError for what is no surface, or lies elsewhere than its mesh."""
    checks.instance(render, Surface, "render", "a wc.Surface")
    x, size = mesh.vertices, float(np.ptp(mesh.vertices, axis=0).max())
    off = np.maximum(render.vertices - x.max(axis=0), x.min(axis=0) - render.vertices).max()
    if off > size:
        raise ValueError(
            f"its render surface reaches {off:.3g} m away from its mesh of {size:.3g} m: give it "
            f"in the frame and the unit of the mesh"
        )


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
