"""Hooks for the coupled solvers of Newton: those that other solvers exchange forces by."""

import numpy as np
import warp as wp
from newton import BodyFlags
from newton.solvers.experimental.coupled import CouplingInterface

from warp_contact import Simulation
from warp_contact.newton.layout import Solid
from warp_contact.newton.refusals import numbers
from warp_contact.scene.scene import rotation_matrix

FAR = 0.5  # of its size: a proxy that is put further away jumps
STEPS = 2.0  # of ours, at least, in which a proxy goes all of the way to where it should be
LEARNT = 0.1  # in a step, of what moves a body beside gravity and contact


class Coupling(CouplingInterface):
    """Bodies of another solver are proxies here, and soft bodies have proxies elsewhere.

    A proxy moves as a rigid body of its own during a step, and the force of contact on it is what
    the other solver is told; not that of statics, driven bodies and other proxies, which the other
    solver has by itself.

    The other solver steps first, with the force of the step before. A proxy that began its step
    where the body began that one would answer contacts anew that the body has yet to be told of: a
    feedback a step late, by which light bodies on stiff ones tumble. So it goes ahead: it begins
    where the body has ended, by which the force is in time for the body's next step, and the two
    move as one body would. With iterations both take the same step.
    """

    _restarts, _stepped = False, True
    _begun: np.ndarray
    _beside: np.ndarray
    _told_qd: np.ndarray
    _kept: tuple[Simulation | None, dict, list] = (None, {}, [])

    def coupling_supports_full_surface_soft_contacts(self) -> bool:
        """All of a surface touches; contacts are found here, whatever is passed."""
        return True

    def coupling_eval_gravity_acceleration(
        self, out_body_acceleration, out_particle_acceleration
    ) -> None:
        """As Newton does it; raises NotImplementedError for a coupling that is not by proxies.

        ADMM alters velocities of single particles between its iterations, by their masses; here
        the mass of a body is divided among them otherwise.
        """
        if not self._proxies.any():
            raise NotImplementedError(
                "SolverContactSurface is coupled by SolverCoupledProxy alone: make rigid bodies of "
                "the other solver proxies in this one"
            )
        super().coupling_eval_gravity_acceleration(out_body_acceleration, out_particle_acceleration)

    def coupling_notify_iteration_restarts(self, enabled: bool) -> None:
        """Steps may begin again: then each keeps where it began, which is all of a checkpoint."""
        self._restarts = enabled

    def coupling_notify_input_state_update(
        self, state, flags, *, iteration_restart=False, dt=0.0
    ) -> None:
        """A step of the coupled solver begins, or begins again where it did before."""
        if dt <= 0.0:
            return
        if iteration_restart:
            self._begin_again()
        elif self._restarts and self._stepped:
            values = self.simulation._values() if self.simulation else {}
            kept = {name: np.array(value) for name, value in values.items()}
            self._kept = self.simulation, kept, [a.copy() for a in self._given()]
        if iteration_restart or self._stepped:
            self._begun = numbers(state.body_q).copy()
        self._stepped = False

    def coupling_rewind_proxy_body(
        self, body_local_to_proxy_global, state, coupling_forces, body_gravity_acceleration, dt
    ) -> None:
        """Put proxies where their step begins, with the velocity that the other solver gave them.

        A lagged proxy is given the place where its body began; staggered, or with SolverXPBD, which
        writes it into its input, the one where it ended.
        """
        of, gravity = body_local_to_proxy_global.numpy(), body_gravity_acceleration.numpy()
        forces = coupling_forces.numpy()
        q, qd, wrench = state.body_q.numpy(), state.body_qd.numpy(), state.body_f.numpy()
        for solid in (s for s in self._layout.solid if of[s.body] >= 0 and not s.driven):
            b = solid.body
            told = forces[of[b]] if forces[of[b]].any() else self._gained[b] / dt
            mass = self._mass(b, q)
            sped_up = np.linalg.solve(mass, told)
            sped_up[:3] += gravity[b]
            ended = (q[b] != self._begun[b]).any()
            if self._restarts == ended:
                self._move_on(b, q, qd, -dt if ended else dt)
            self._gained[b] = wrench[b] = 0.0
            if self._restarts:
                qd[b] -= dt * sped_up
            else:
                wrench[b] = mass @ self._learn(b, qd[b], sped_up, dt)
            if self.simulation and not self._jump_body[b]:
                self._let_move(solid, q, qd, dt, gravity[b] + wrench[b, :3] / mass[0, 0])
        state.body_q.assign(q)
        state.body_qd.assign(qd)
        state.body_f.assign(wrench)

    def coupling_harvest_proxy_wrenches(
        self,
        body_local_to_proxy_global,
        out_body_f,
        *,
        body_qd_before,
        state,
        state_out,
        contacts,
        dt,
    ) -> None:
        """Write the force of contacts with what is this solver's, mean of the step.

        A change of velocity is no measure of it: velocities that are read have contacts answer for
        half a step, and those that are set are of one of two bodies that touch.
        """
        del body_qd_before, state, state_out, contacts
        own, out = body_local_to_proxy_global.numpy(), np.zeros(out_body_f.shape + (6,))
        for body in np.flatnonzero(own >= 0):
            out[own[body]] = self._gained[body] / dt
        out_body_f.assign(out)

    def _move_on(self, b: int, q: np.ndarray, qd: np.ndarray, dt: float) -> None:
        """Let a pose of ``q``, shape (n, 7), be where its velocity brings it in ``dt`` [s]."""
        centre, w = self._centre(b, q), wp.vec3(*qd[b, 3:].tolist())
        turn = wp.quat_from_axis_angle(wp.normalize(w), dt * wp.length(w))
        q[b, 3:] = list(turn * wp.quat(*q[b, 3:].tolist()))
        q[b, :3] += centre + dt * qd[b, :3] - self._centre(b, q)

    def _mass(self, b: int, q: np.ndarray) -> np.ndarray:
        """Mass [kg] and inertia [kg m^2] of a body at a pose of ``q``, shape (6, 6)."""
        turn, out = rotation_matrix(q[b, 3:].astype(np.float64)), np.zeros((6, 6))
        out[:3, :3] = self.model.body_mass.numpy()[b] * np.eye(3)
        out[3:, 3:] = turn @ self.model.body_inertia.numpy()[b] @ turn.T
        return out

    def _learn(self, b: int, qd: np.ndarray, sped_up: np.ndarray, dt: float) -> np.ndarray:
        """What else moves a body [m/s^2], [rad/s^2], shape (6,): joints, motors, other contacts.

        Without it a proxy that a motor presses on a body would stay behind by a step of its force.
        Taken over at once it is a feedback a step late again.
        """
        now = (qd - self._told_qd[b]) / dt - sped_up
        known = np.isfinite(now).all()
        self._beside[b] += LEARNT * (now - self._beside[b]) if known else -self._beside[b]
        self._told_qd[b] = qd
        return self._beside[b]

    def _let_move(
        self, solid: Solid, q: np.ndarray, qd: np.ndarray, dt: float, gravity: np.ndarray
    ) -> None:
        """Make the way from where a proxy is to where it should be a velocity, and no jump.

        What is put elsewhere is moved apart without motion: its momentum would be lost. Where a
        contact stops the velocity at once, a whole way in the first of many steps swings up.
        """
        b, sim = solid.body, self.simulation
        turn = wp.quat(*q[b, 3:].tolist()) * wp.quat_inverse(wp.quat(*self._pose[b, 3:].tolist()))
        axis, angle = wp.quat_to_axis_angle(turn)
        way = self._centre(b, q) - self._centre(b, self._pose)
        if np.linalg.norm(way) >= FAR * np.ptp(sim.positions(solid.index), axis=0).max():
            return
        step = 1.0 / (sim.fps * max(sim.substeps, 1))
        part = min(1.0, STEPS * step / dt)
        qd[b] += part / dt * np.concatenate([way, angle * np.array(axis)])
        qd[b, :3] += 0.5 * step * gravity  # theirs is the velocity of the middle of a step
        q[b] = self._pose[b]

    def _begin_again(self) -> None:
        sim, values, given = self._kept
        if sim is None or sim is not self.simulation:
            if self.simulation:
                self._begin(self.simulation)
            return
        sim._continue(values)
        for array, before in zip(self._given(), given, strict=True):
            array[:] = before

    def _given(self) -> tuple[np.ndarray, ...]:
        """What the last step gave, and what is to be put elsewhere without motion."""
        return self._q, self._qd, self._pose, self._twist, self._jump, self._jump_body

    @property
    def _proxies(self) -> np.ndarray:
        """Which bodies are of another solver, shape (n,)."""
        return numbers(self.model.body_flags).astype(int) & int(BodyFlags.PROXY) != 0

    def _count(self, sim: Simulation, dt: float) -> None:
        """Add the impulses on proxies, after a step ``dt`` [s]."""
        proxies, solids = self._proxies, self._layout.solid
        of = {sim.scene.bodies[s.index].label: s.body for s in solids if proxies[s.body]}
        if not of:
            return
        force, x = sim.contact_fields()["force"].astype(np.float64), sim.positions()
        for solid in (s for s in solids if proxies[s.body]):
            on, at = force[solid.vertices], x[solid.vertices]
            self._add(solid.body, dt * on, at)
        ours = {sim.scene.bodies[s.index].label for s in self._layout.soft}
        ours |= {sim.scene.bodies[s.index].label for s in solids if not s.driven}
        ours -= set(of)
        for (first, second), pair in sim.forces().items():
            for name, other, sign in ((first, second, 1.0), (second, first, -1.0)):
                if name in of and other not in ours:
                    self._add(of[name], -sign * dt * pair.total[None], pair.point)

    def _add(self, body: int, impulses: np.ndarray, at: np.ndarray) -> None:
        arms = at - self._centre(body, self._pose)
        both = impulses.sum(axis=0), np.cross(arms, impulses).sum(axis=0)
        self._gained[body] += np.concatenate(both)
