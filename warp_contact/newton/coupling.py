"""Hooks for the coupled solvers of Newton: those that other solvers exchange forces by."""

import numpy as np
import warp as wp
from newton import BodyFlags, StateFlags
from newton.solvers.experimental.coupled import CouplingInterface

from warp_contact import Simulation
from warp_contact.newton.refusals import numbers

FAR = 0.5  # of its size: a proxy that is put further away jumps


class Coupling(CouplingInterface):
    """Bodies of another solver are proxies here, and soft bodies have proxies elsewhere.

    A proxy moves as a rigid body of its own during a step, and the force of contact on it is what
    the other solver is told; not that of statics, driven bodies and other proxies, which the other
    solver has by itself.
    """

    _restarts, _stepped = False, True
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
        self._stepped = False
        self._gained[:] = 0.0
        if int(flags) & int(StateFlags.BODY_Q) and self.simulation:
            self._let_proxies_move(state, dt)

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

    def _let_proxies_move(self, state, dt: float) -> None:
        """Make the way from where a proxy is to where it should be a velocity, and no jump.

        What is put elsewhere is moved apart without motion: its momentum would be lost.
        """
        q, qd, moved = state.body_q.numpy(), state.body_qd.numpy(), False
        for solid in self._layout.solid:
            b = solid.body
            if not self._proxies[b] or self._jump_body[b] or (q[b] == self._pose[b]).all():
                continue
            turn = wp.quat(*q[b, 3:].tolist()) * wp.quat_inverse(
                wp.quat(*self._pose[b, 3:].tolist())
            )
            axis, angle = wp.quat_to_axis_angle(turn)
            way = self._centre(b, q) - self._centre(b, self._pose)
            if (
                np.linalg.norm(way)
                < FAR * np.ptp(self.simulation.positions(solid.index), axis=0).max()
            ):
                qd[b] += np.concatenate([way, angle * np.array(axis)]) / dt
                q[b], moved = self._pose[b], True
        if moved:
            state.body_q.assign(q)
            state.body_qd.assign(qd)

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
