"""``SolverContactSurface``: contact surfaces as a solver of Newton."""

import newton
import numpy as np
from newton import StateFlags
from newton.solvers import SolverBase

from warp_contact import Simulation, checks
from warp_contact.newton import observables as told
from warp_contact.newton.coupling import Coupling
from warp_contact.newton.joints import add_joint_forces
from warp_contact.newton.layout import Soft, Solid, lay_out
from warp_contact.newton.refusals import numbers
from warp_contact.scene.pose import rigid_motion_of
from warp_contact.scene.scene import rotation_matrix

SAME = 1e-6  # relative: of a length of the step
UNLIMITED = 1e5  # particle_max_velocity as Newton sets it [m/s]


class SolverContactSurface(Coupling, SolverBase):
    """Soft bodies of tets, rigid bodies and static shapes that touch by contact surfaces.

    A step of Newton is a frame here: it is divided into as many steps as are stable. How many is
    decided on the host, so that ``step`` cannot be captured: it raises RuntimeError within a
    capture. Contacts are found by the solver itself: ``contacts`` are not looked at, nor are radii
    of particles, nor stiffness and damping of contacts. Of ``control`` forces of joints act.

    Tets of a piece are a body with the material of SolverVBD: Lame parameters k_mu and k_lambda,
    and a damping time 4 k_damp / E, with which a bar that stretches has the same viscous stress.
    Its mass is that of its particles, divided among them by volume. Particles without mass, or not
    active, are held: what the user writes into their positions is where they are at the end of the
    step, and they move by their velocities. So are bodies that are kinematic, without mass or
    fixed to the world, by ``body_q`` alone. All shapes of a body that collide are one. Joints that
    are fixed, ball, revolute or prismatic hold hard. Friction between two bodies, or a body and a
    shape, is the mean of theirs; soft ones have ``model.soft_contact_mu``. There is no contact of a
    body with itself, nor of bodies with a joint.

    ``particle_f`` acts as an impulse at the beginning of the step, ``body_f`` during the step.
    """

    SUPPORTED_OBSERVABLES = told.SUPPORTED
    ObservableKind = told.ObservableKind
    Observables = told.Observables

    def __init__(
        self,
        model: newton.Model,
        *,
        integrator: str = "explicit",
        thickness: float | None = None,
    ):
        """Translate the model.

        Args:
            model: as finalized, at rest
            integrator: ``explicit``, ``implicit`` or ``auto``, as of ``wc.Simulation``; with rigid
                bodies, joints or attachments of particles steps are implicit
            thickness: of the shells that stand for meshes, capsules and finite planes [m]; by
                default 0.05 of the diagonal of each

        Raises:
            ValueError: naming what cannot be simulated: other joints, drives, springs, cloth,
                grains, skins, bodies of several materials, unknown shapes, margins, restitution,
                groups and filters of collisions, a model with gradients
        """
        super().__init__(model)
        if thickness is not None:
            thickness = checks.positive(thickness, "thickness")
        self._integrator, self._thickness = integrator, thickness
        self._layout = lay_out(model, thickness)
        self.simulation: Simulation | None = None
        self._forget()

    def step(self, state_in, state_out, control, contacts, dt, *, observables=None) -> None:
        """Go on by ``dt`` [s] from one state to the other, which may be the same.

        Where a state is not what the last step gave, bodies are put there, without motion. The
        first step, and one of another ``dt``, lays out a simulation: half a second.

        Raises:
            RuntimeError: within a capture
            SimulationError: no step is stable, or a number is not finite
        """
        self._refuse_capture("step")
        self.validate_observables(observables)
        forces = self._joint_forces(control)
        sim = self._at(checks.positive(dt, "dt"))
        try:
            given = self._take(sim, state_in, forces, dt)
            before = given[3].copy()  # on a CPU that is the state itself
            sim.step_frame()
            self._give(sim, state_out, *given)
            self._stepped = True
            self._count(sim, dt)
        except BaseException:
            self._lose()
            raise
        if observables is not None and observables.kinds:
            told.observe(sim, self._layout, (self._twist - before) / dt, observables)

    def reset(self, state, world_mask=None, flags=None) -> None:
        """Begin anew: the next step begins where its state is, as the first one did.

        What ``flags`` name of particles and bodies is written into the state as the model has it,
        by default their positions and velocities; ``flags=0`` leaves the state as it is. With
        ``world_mask`` in these worlds alone.

        Raises:
            RuntimeError: within a capture
        """
        self._refuse_capture("reset")
        mask = self._normalize_reset_world_mask(world_mask)
        worlds = self.model.world_count + 1  # the last one is world -1
        chosen = np.ones(worlds, dtype=bool) if mask is None else mask.numpy()
        particles = chosen[numbers(self.model.particle_world).astype(int)]
        bodies = chosen[numbers(self.model.body_world).astype(int)]
        every = StateFlags.PARTICLE | StateFlags.BODY
        self._layout.restore(state, particles, bodies, int(every if flags is None else flags))
        self._gained[bodies], self._told_qd[bodies] = 0.0, np.nan
        if self.simulation is None:
            return
        if mask is None:
            self._begin(self.simulation)
            return
        self._jump |= particles
        self._jump_body |= bodies

    def notify_model_changed(self, flags) -> None:
        """Translate the model anew; the next step begins where its state is.

        Raises:
            ValueError: as for a new solver
            RuntimeError: within a capture
        """
        self._refuse_capture("notify_model_changed")
        self._layout = lay_out(self.model, self._thickness)
        self.simulation = None
        self._forget()

    def set_collision_frequency(self, **schedule) -> None:
        """Contacts are found in each step; raises ValueError for another schedule."""
        if any(schedule.values()):
            raise ValueError("SolverContactSurface finds contacts in each step: leave it to it")
        super().set_collision_frequency()

    def update_contacts(self, contacts, state=None) -> None:
        """Contacts of Newton are not looked at: raises NotImplementedError."""
        raise NotImplementedError(
            "SolverContactSurface finds contacts by itself: ask for the observable "
            "particle_contact_f, or for solver.simulation.contacts()"
        )

    def _refuse_capture(self, what: str) -> None:
        if self.device.is_capturing:
            raise RuntimeError(
                f"SolverContactSurface.{what} works on the host too, where it decides how many "
                "steps it takes, and cannot be captured: call it in every frame"
            )

    def _joint_forces(self, control) -> np.ndarray:
        """Generalized forces, shape (joint_dof_count,); raises ValueError for activations."""
        if control is None:
            return numbers(self.model.joint_f)
        if numbers(control.tet_activations).any():
            raise ValueError("control.tet_activations is not zero: tets have no muscles here")
        return numbers(control.joint_f)

    def _at(self, dt: float) -> Simulation:
        """A simulation whose frames are ``dt`` [s] long."""
        sim = self.simulation
        if sim is None or abs(sim.fps * dt - 1.0) > SAME:
            name = str(self.model.device)
            scene = self._layout.scene
            kind = "implicit" if scene.attachments else self._integrator
            sim = Simulation(scene, fps=1.0 / dt, device=name, integrator=kind)
            self.simulation = sim
            self._begin(sim)
        return sim

    def _begin(self, sim: Simulation) -> None:
        """Begin where the scene does; held ones are put where the state has them."""
        sim.reset()
        self._forget()

    def _forget(self) -> None:
        self._q, self._qd, self._pose, self._twist = (a.copy() for a in self._layout.start)
        self._jump = np.ones(self.model.particle_count, dtype=bool)
        self._jump_body = np.ones(self.model.body_count, dtype=bool)
        self._gained, self._beside = np.zeros((2, self.model.body_count, 6))
        self._told_qd = np.full((self.model.body_count, 6), np.nan)

    def _lose(self) -> None:
        """After an error nothing is known: the next step puts everything where its state has it."""
        for last in self._q, self._qd, self._pose, self._twist, self._told_qd:
            last[:] = np.nan
        self._jump[:], self._jump_body[:] = True, True

    def _take(
        self, sim: Simulation, state, forces: np.ndarray, dt: float
    ) -> tuple[np.ndarray, ...]:
        """Put everything where a state has it; return its positions, poses and their velocities."""
        arrays = state.particle_q, state.particle_qd, state.body_q, state.body_qd
        q, qd, poses, twists = (numbers(a) for a in arrays)
        force, push = numbers(state.particle_f), qd
        if force.any():
            push, inv_mass = qd.copy(), sim.model.inv_mass.numpy()
            for soft in self._layout.soft:
                own = soft.particles
                push[own] += dt * force[own] * inv_mass[soft.vertices][:, None]
        for soft in self._layout.soft:
            self._take_soft(sim, soft, q, push, dt)
        wrench = numbers(state.body_f).astype(np.float64)
        if forces.any():
            add_joint_forces(self.model, forces, poses, wrench)
        for solid in self._layout.solid:
            b = solid.body
            self._take_solid(sim, solid, poses[b], twists[b], wrench[b])
        self._jump[:], self._jump_body[:] = False, False
        return q, qd, poses, twists

    def _take_soft(
        self, sim: Simulation, soft: Soft, q: np.ndarray, qd: np.ndarray, dt: float
    ) -> None:
        own, held, free = soft.particles, soft.held, np.flatnonzero(~soft.held)
        moved = (q[own] != self._q[own]).any(axis=1) & (~held | self._jump[own])
        if moved.any():
            sim.set_positions(soft.index, q[own])
        if (qd[own[free]] != self._qd[own[free]]).any():
            sim.set_velocity(soft.index, qd[own[free]], free)
        if held.any():
            goal = q[own[held]] + dt * qd[own[held]]
            if (goal != sim.positions(soft.index)[held]).any():
                sim.move_to(soft.index, goal, held)

    def _take_solid(
        self, sim: Simulation, solid: Solid, q: np.ndarray, qd: np.ndarray, force: np.ndarray
    ) -> None:
        b, k = solid.body, solid.index
        moved = (q != self._pose[b]).any()
        if moved and solid.driven and not self._jump_body[b]:
            sim.move_to(k, pose=(q[:3], q[3:]))
        elif moved:
            sim.set_pose(k, q[:3], q[3:])
        if solid.driven:
            return
        if moved or (qd != self._twist[b]).any():
            x = sim.positions(k).astype(np.float64)
            turn, centre = sim.pose(k), self.model.body_com.numpy()[b].astype(np.float64)
            arm = x - _placed(centre, *turn)
            sim.set_velocity(k, qd[:3] + np.cross(qd[3:], arm))
        if force.any():
            sim.apply(k, force[:3], force[3:])

    def _give(self, sim: Simulation, state, *given: np.ndarray) -> None:
        """Write a state; what is not simulated is as ``given``."""
        x, v = sim.positions(), sim.velocities()
        self._q, self._qd, self._pose, self._twist = (a.copy() for a in given)
        for soft in self._layout.soft:
            own, free = soft.particles, ~soft.held  # those of held ones are the user's
            self._q[own] = x[soft.vertices]
            self._qd[own[free]] = v[soft.vertices][free]
            if self.model.particle_max_velocity < UNLIMITED:
                self._limit(sim, soft)
        state.particle_q.assign(self._q)
        state.particle_qd.assign(self._qd)
        if self.model.body_count:
            for solid in (s for s in self._layout.solid if not s.driven):
                self._give_solid(sim, solid, v[solid.vertices])
            state.body_q.assign(self._pose)
            state.body_qd.assign(self._twist)

    def _limit(self, sim: Simulation, soft: Soft) -> None:
        """Slow down particles that are faster than the model lets them."""
        own, free = soft.particles, np.flatnonzero(~soft.held)
        speed = np.linalg.norm(self._qd[own[free]], axis=1, keepdims=True)
        most = self.model.particle_max_velocity
        if speed.max(initial=0.0) > most:
            self._qd[own[free]] *= np.minimum(1.0, most / np.maximum(speed, most))
            sim.set_velocity(soft.index, self._qd[own[free]], free)

    def _give_solid(self, sim: Simulation, solid: Solid, v: np.ndarray) -> None:
        place = sim.pose(solid.index)
        centre = _placed(self.model.body_com.numpy()[solid.body].astype(np.float64), *place)
        x = sim.positions(solid.index)
        motion = rigid_motion_of(x, v, np.ones(len(x)), centre)
        self._pose[solid.body] = np.concatenate(place)
        self._twist[solid.body] = np.concatenate(motion)

    def _centre(self, b: int, poses: np.ndarray) -> np.ndarray:
        """Centre of mass [m] of body ``b`` at one of the poses, shape (n, 7)."""
        centre, q = self.model.body_com.numpy()[b], poses[b].astype(np.float64)
        return _placed(centre.astype(np.float64), q[:3], q[3:])


def _placed(point: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """A point of a body's frame in the world [m]."""
    return rotation_matrix(rotation) @ point + position
