"""What a user reads and sets of a simulation between its frames."""

from functools import partial

import numpy as np

from warp_contact import checks
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.exclusive import exclusively
from warp_contact.frame import between
from warp_contact.frame.moves import Moves
from warp_contact.frame.stepper import Stepper
from warp_contact.frame.surroundings import Surroundings
from warp_contact.measure.measure import Meter
from warp_contact.measure.skins import Skins
from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.pose import centre_of, frame_of, pose_of, rigid_motion_of
from warp_contact.scene.scene import Body, Scene, rotation_matrix
from warp_contact.scene.selection import Bodies
from warp_contact.scene.topology import HUGE


class BetweenFrames:
    """Positions, velocities, poses and forces of the bodies of a simulation."""

    scene: Scene
    model: Model
    state: State
    device: object
    _bodies: Bodies
    _stepper: Stepper
    _surroundings: Surroundings
    _meter: Meter
    _moves: Moves
    _skins: Skins

    def positions(self, body: Body | int | str | None = None) -> np.ndarray:
        """Copy of the positions [m] of one body or of all, shape (n, 3)."""
        return self.state.x.numpy()[self._bodies.range(body)].copy()

    def velocities(self, body: Body | int | str | None = None) -> np.ndarray:
        """Velocities [m/s] of one body or of all, at the time of the positions, shape (n, 3)."""
        chosen = self._bodies.range(body)
        with exclusively(self.device):
            return self._stepper.velocities()[chosen]

    def rendered(self, body: Body | int | str) -> tuple[np.ndarray, np.ndarray]:
        """Vertices [m] and unit normals of the render surface of a body, as it lies now.

        Returns:
            The vertices, shape (n, 3), and normals, (n, 3), or of each corner of each triangle
            where the surface has these, (f, 3, 3).

        Raises:
            ValueError: there is no such body, or it has no render surface
        """
        index = self._bodies.index(body)
        if index not in self._skins:
            raise ValueError(f"body '{self._bodies.label(body)}' was given no render surface")
        with exclusively(self.device):
            return self._skins.at(index, self.state.x)

    def set_positions(self, body: Body | int | str | None, positions, vertices=None) -> None:
        """Put vertices elsewhere between frames, as at the start of an episode.

        This is no motion: nothing on the way is touched or counted, and velocities stay. Overlaps
        at the new place are moved apart like those at the start of a run. All bodies wake. What
        was on its way by ``move_to`` stands still.

        Args:
            body: the body; None for all
            positions: shape (k, 3) for k vertices [m]
            vertices: mask or ids within the body, or among all; None for all of them

        Raises:
            ValueError: there is no such body or vertex, or they are not finite or of that shape
        """
        x = self.state.x.numpy().copy()
        part, chosen = self._bodies.choose(x, body, vertices)
        of = "positions" if body is None else f"positions of body '{self._bodies.label(body)}'"
        part[chosen] = checks.numbers(positions, part[chosen].shape, of, HUGE)
        self._bodies.refuse_far(x, body)
        self._bodies.refuse_bent(x, body)
        with exclusively(self.device):
            self._meter.tunnelling.follow(self.state.x)
            self._moves.end(self._at(body, chosen), self.state)
            self._stepper.set_positions(x, self._bodies.range(body))
            own = self.model.vert_body.numpy()[self._bodies.range(body)]
            placed = np.isin(np.arange(self.model.n_body), own)
            self._meter.tunnelling.jump(self.state.x, placed)

    def set_velocity(self, body: Body | int | str, velocity, vertices=None) -> None:
        """Set velocities [m/s] between frames; fixed vertices keep theirs from then on.

        It ends what ``move_to`` began.

        Args:
            body: the body
            velocity: shape (3,), or (k, 3) for k vertices
            vertices: mask or ids within the body; None for all

        Raises:
            ValueError: there is no such body or vertex, or it is not finite or of that shape
        """
        v = np.zeros((self.model.n_vert, 3), dtype=np.float32)
        part, chosen = self._bodies.choose(v, body, vertices)
        of = f"velocity of body '{self._bodies.label(body)}'"
        part[chosen] = checks.vectors(velocity, len(chosen), of, checks.FASTEST)
        at = self._at(body, chosen)
        with exclusively(self.device):
            self._moves.end(at, self.state)
            self._stepper.set_velocities(v[at], at, self._bodies.index(body))

    def move_to(
        self, body: Body | int | str, positions=None, vertices=None, over: int = 1, *, pose=None
    ) -> None:
        """Let fixed vertices reach a place after ``over`` frames, and stand still there.

        With positions they go straight, at a constant speed. With a pose the frame of the mesh
        does, and turns at a constant rate the shorter way round; so does a rigid body with both.
        Within a frame vertices go straight: more than half a radian a frame is refused.

        Args:
            body: the body
            positions: where they shall be [m], shape (k, 3)
            vertices: mask or ids within the body, all fixed; None for all that are
            over: number of frames
            pose: position [m] and rotation (x, y, z, w) of the mesh, in place of ``positions``

        Raises:
            ValueError: there is no such body or vertex, one is not fixed, a number is not finite or
                of that shape, a turn is too fast, or a rigid body would change its shape
        """
        over = checks.count(over, "over")
        x = self.state.x.numpy().copy()
        part, chosen = self._bodies.choose_fixed(x, body, vertices)
        before = part[chosen].astype(np.float64)
        place = self._bodies.goal_pose(body, pose, positions)
        mesh = self._mesh(body).vertices[chosen]
        if place is None:
            of = f"positions of body '{self._bodies.label(body)}'"
            part[chosen] = checks.numbers(positions, before.shape, of, HUGE)
        else:
            part[chosen] = mesh @ place[1].T + place[0]
        self._bodies.refuse_far(x, body)
        self._bodies.refuse_bent(x, body)
        every = np.ones(len(chosen))
        if place is None and self._bodies.is_rigid(body):
            place = frame_of(part[chosen].astype(np.float64), mesh, every)
        way = place and (mesh, frame_of(before, mesh, every), place)
        try:
            self._moves.begin(self._at(body, chosen), before, part[chosen], over, way)
        except ValueError as error:
            raise ValueError(f"body '{self._bodies.label(body)}': {error}") from None

    def pose(self, body: Body | int | str) -> tuple[np.ndarray, np.ndarray]:
        """Position [m] and rotation (x, y, z, w) of a body: x = R vertices + position.

        As given to ``add_body`` at the start; the nearest one of a body that has deformed.
        """
        own, mesh = self._bodies.range(body), self._mesh(body)
        mass = self.model.mass.numpy()[own].astype(np.float64)
        return pose_of(self.positions(body).astype(np.float64), mesh.vertices, mass)

    def set_pose(self, body: Body | int | str, position, rotation=(0.0, 0.0, 0.0, 1.0)) -> None:
        """Put a body elsewhere between frames in its shape at rest, as ``set_positions`` does.

        It keeps the velocity of its centre of mass and its angular velocity, and no other motion.

        Args:
            body: the body
            position: translation of its mesh [m]
            rotation: of its mesh, a quaternion (x, y, z, w)

        Raises:
            ValueError: there is no such body, or they are not finite or of that shape
        """
        mesh = self._mesh(body)
        moved = checks.numbers(position, (3,), "position", HUGE)
        mass = self.model.mass.numpy()[self._bodies.range(body)].astype(np.float64)
        x0, v0 = self.positions(body), self.velocities(body)
        v, w = rigid_motion_of(x0, v0, mass, self._centre(body, x0))
        x = mesh.vertices @ rotation_matrix(rotation).T + moved
        self.set_positions(body, x)
        if not self.scene.bodies[self._bodies.index(body)].fixed.any():
            self.set_velocity(body, v + np.cross(w, x - self._centre(body, x)))

    def apply(
        self, body: Body | int | str, force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0), at=None
    ) -> None:
        """Let a force and a torque act on a body during the next frame, beside those before.

        It wakes. Where the frame fails, they act in the next one that does not.

        A body that deforms takes them as a whole: every vertex has the same acceleration, and that
        of the turning.

        Args:
            body: the body, without fixed vertices
            force: [N]
            torque: [N m]
            at: point at which the force acts [m]; the centre of mass by default

        Raises:
            ValueError: there is no such body, it has fixed vertices, the steps are explicit, or a
                number is not finite
        """
        index = self._bodies.index(body)
        force, torque = checks.numbers(force, (3,), "force"), checks.numbers(torque, (3,), "torque")
        if at is not None:
            arm = checks.numbers(at, (3,), "at", HUGE) - self._centre(body, self.positions(body))
            torque = torque + np.cross(arm, force)
        with exclusively(self.device):
            try:
                self._stepper.wrench.add(index, force, torque)
            except ValueError as error:
                raise ValueError(f"body '{self._bodies.label(index)}': {error}") from None
            if self._stepper.sleeping:
                self._stepper.sleeping.wake(index)

    def _wake_bodies(self, at: np.ndarray) -> None:
        """Wake the bodies of vertices ``at``."""
        if self._stepper.sleeping:
            for index in np.unique(self.model.vert_body.numpy()[at]).tolist():
                self._stepper.sleeping.wake(index)

    def _at(self, body: Body | int | str | None, chosen: np.ndarray) -> np.ndarray:
        """Vertices ``chosen`` of a body, or of all, as the model numbers them."""
        return (self._bodies.range(body).start or 0) + chosen

    def _mesh(self, body: Body | int | str) -> TetMesh:
        return self.scene.bodies[self._bodies.index(body)].mesh

    def set_gravity(self, gravity) -> None:
        """Set gravity [m/s^2], shape (3,), for the frames to come; all bodies wake.

        Raises:
            ValueError: it is not three finite numbers
        """
        g = checks.numbers(gravity, (3,), "gravity")
        with exclusively(self.device):
            s = self._stepper
            s.buffers.set_steps(s.last.dt)
            change = partial(self._surroundings.set_gravity, g)
            between.change_gravity(self.model, self.state, s.work, s.last_dt, change)
            self._wake(np.ones(s.worlds.n, dtype=bool))

    def set_friction(self, of: Body | int | str, friction: float) -> None:
        """Set the Coulomb coefficient of a body or a plane for the frames to come.

        Between two of them the mean of theirs counts. Bodies of its world wake, of a plane all.

        Args:
            of: the body, or the name of a plane, such as ``plane0``
            friction: coefficient [-]

        Raises:
            ValueError: there is no such body or plane, or it is negative or not finite
        """
        self._set_coefficient("friction", of, checks.number(friction, "friction", least=0.0))

    def set_restitution(self, of: Body | int | str, restitution: float) -> None:
        """Set the coefficient of restitution as ``set_friction`` does.

        Raises:
            ValueError: there is no such body or plane, it is not from 0 to 1, or steps take none
        """
        self._set_coefficient(
            "restitution", of, checks.number(restitution, "restitution", 0.0, 1.0)
        )

    def _set_coefficient(self, name: str, of: Body | int | str, value: float) -> None:
        index = self._bodies.index_or_plane(of)
        of_body = self._stepper.worlds.of_body
        woken = np.ones(self._stepper.worlds.n, dtype=bool)
        if index < self.model.n_body:
            woken = np.arange(len(woken)) == of_body[index]
        with exclusively(self.device):
            if name == "restitution" and value:
                self._stepper.buffers.let_rebound()
            self._surroundings.set_coefficient(name, index, value)
            self._wake(woken)

    def _wake(self, worlds: np.ndarray) -> None:
        """Wake all bodies of worlds, a mask."""
        if self._stepper.sleeping:
            self._stepper.sleeping.wake_all(worlds, self._stepper.work)

    def _centre(self, body: Body | int | str, x: np.ndarray) -> np.ndarray:
        """Centre of mass [m] of a body at ``x``, shape (3,)."""
        own, index = self._bodies.range(body), self._bodies.index(body)
        mass = self.model.mass.numpy()[own].astype(np.float64)
        return centre_of(x, self.model.rest[own], mass, self.model.solids[index])
