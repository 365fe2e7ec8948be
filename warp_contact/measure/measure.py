"""Energies, momenta, overlaps and contact forces of a state, for people and for tests."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_contact.data.contacts import first
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.ties import TieWork
from warp_contact.data.work import Work
from warp_contact.kernels.lengths import UNHELD
from warp_contact.kernels.motion import motion
from warp_contact.kernels.output import measure as kernels
from warp_contact.kernels.output import self_overlap as own
from warp_contact.kernels.ties.attachment import Partners
from warp_contact.measure.solids import Solids
from warp_contact.measure.trees import Trees
from warp_contact.measure.tunnelling import Tunnelling
from warp_contact.scene import topology
from warp_contact.step.forces import energies, internal_forces


@dataclass(frozen=True)
class Measure:
    """One frame in numbers; of a state that is not finite they are NaN.

    Attributes:
        kinetic: energy [J] at the time of the positions, from the velocities of half a step h
            before: h/2 times the power of internal forces and weight is added, and in free flight
            m (h g)^2 / 8. The sum of all energies is then constant for a linear material in free
            flight, and a contact impulse p changes it by p . (v + v') / 2, v and v' the velocities
            before and after the step: not at all while the contact stays closed. Of bodies that
            take implicit steps: from the velocities at that time
        elastic: energy [J]
        gravitational: energy against the origin [J]
        momentum: at the time of the positions [kg m/s], shape (3,)
        angular_momentum: the same about the origin [kg m^2/s], shape (3,)
        overlap: deepest overlap of a vertex or an edge [m]; not between bodies that are attached
            to each other: they do not meet
        overlap_pair: labels of its bodies, None without overlap
        self_overlap: deepest overlap of a vertex or an edge with its own body, folded or of several
            pieces [m]; at most the thickness of what went in. Nothing holds it: contact is between
            different bodies only. What belongs to an inverted tet is left out
        self_overlap_body: label of this body, None without self-overlap
        n_contacts: contacts in the last step
        volume_ratio: smallest volume of a tet over its rest volume
        inverted: tets that are inside out or flat
        tunnelled: points that went through another body so far; a point is a surface vertex or the
            middle of a surface edge. It counts where it goes out by a face that faces away from the
            one by which it came in and was deeper than a tenth of the body's thickness (twice its
            volume over its surface), or where it gets deeper below a plane than its own body is
            thick. Between two calls paths are taken as straight: call often. Not counted:
            what happened before the first call, what turned back between two calls, points that
            were inside a body at the first call, and parts that slip between the points of a
            coarser body. A body that starts on both sides of another and is led back counts
        tunnelled_pair: labels of the bodies of the last of these, the one that went through first
        unheld: surface vertices in another body or below a plane, by more than 0.01 of a mean edge,
            that had no contact in the last step
        unsolved: how often the impulses or the closure of a world ran out of sweeps in the last
            frame, while a contact still approached or overlapped by more than 1e-4 of an edge, or
            points of an attachment were that far apart after a step
        forces: mean contact force of the frame between two bodies, by their labels [N]
    """

    kinetic: float
    elastic: float
    gravitational: float
    momentum: np.ndarray
    angular_momentum: np.ndarray
    overlap: float
    overlap_pair: tuple[str, str] | None
    self_overlap: float
    self_overlap_body: str | None
    n_contacts: int
    volume_ratio: float
    inverted: int
    tunnelled: int
    tunnelled_pair: tuple[str, str] | None
    unheld: int
    unsolved: int
    forces: dict[tuple[str, str], float]

    @property
    def energy(self) -> float:
        """Kinetic, elastic and gravitational energy [J]."""
        return self.kinetic + self.elastic + self.gravitational


class Meter:
    """Measures states of one model; its memory is allocated at the first use.

    Attributes:
        tunnelling: remembers the last state measured, to tell what went through a body since then
    """

    def __init__(self, model: Model, ties: TieWork | None):
        """Read what stays constant; ``ties`` of the step, if there are any."""
        self.model = model
        self.mass = model.mass.numpy().astype(np.float64)  # 0 where a body has its own
        self._solids = Solids(model)
        self.mass[self._solids.vertices] = 0.0
        self.names = [*model.labels, *(f"plane{p}" for p in range(model.n_plane))]
        self._tets, self._body = model.tets.numpy(), model.vert_body.numpy()
        self._volume = model.volume.numpy()
        self._trees, self._partners = Trees(model), ties.partners if ties else Partners()
        self.tunnelling = Tunnelling(model, self.names, self._trees, self._partners)

    @np.errstate(invalid="ignore", over="ignore")
    def measure(
        self, state: State, v: np.ndarray, work: Work, duration: float, dt: np.ndarray
    ) -> Measure:
        """Measure a state; impulses were recorded for ``duration`` [s].

        ``v`` are its velocities at the time of the positions [m/s], shape (n_vert, 3), ``dt`` the
        steps [s], shape (n_vert,).
        """
        model = self.model
        x = state.x.numpy().astype(np.float64)
        v = v.astype(np.float64)
        energy = wp.zeros(model.n_tet, dtype=float)
        energies(model, state.x, energy)
        p, rigid, gravity = self.mass[:, None] * v, self._solids.motion(x, v), model.gravity
        ratio = topology.signed_volumes(x, self._tets) / self._volume
        self.tunnelling.follow(state.x)
        (overlap, pair, unheld), (self_overlap, folded) = (np.nan, None, 0), (np.nan, None)
        if np.isfinite(x).all():
            overlap, pair, unheld = self.overlap(state.x, work)
            self_overlap, folded = self.self_overlap(state.x)
        return Measure(
            kinetic=self._kinetic(state, v, work, dt) + rigid.kinetic,
            elastic=float(energy.numpy().sum(dtype=np.float64)),
            gravitational=float(-(self.mass @ x + rigid.mass @ rigid.centre) @ np.array(gravity)),
            momentum=p.sum(axis=0) + rigid.momentum,
            angular_momentum=np.cross(x, p).sum(axis=0) + rigid.angular_momentum,
            overlap=overlap,
            overlap_pair=pair,
            self_overlap=self_overlap,
            self_overlap_body=folded,
            n_contacts=len(work.contacts.of_step()[0]),
            volume_ratio=float(ratio.min()),
            inverted=int((ratio <= 0.0).sum()),
            tunnelled=self.tunnelling.count,
            tunnelled_pair=self.tunnelling.pair,
            unheld=unheld if duration > 0.0 else 0,
            unsolved=int(work.forces.unsolved.numpy().sum()),
            forces=self.forces(work, duration),
        )

    def _kinetic(self, state: State, now: np.ndarray, work: Work, dt: np.ndarray) -> float:
        """Kinetic energy [J] of all but rigid bodies, see ``Measure``; ``now`` are v [m/s] then."""
        explicit, implicit = self.mass, 0.0
        if work.implicit:
            explicit = np.where(self._lumped(work), self.mass, 0.0)
            implicit = 0.5 * ((self.mass - explicit) @ (now * now)).sum()
            if not explicit.any():
                return float(implicit)
        v = state.v.numpy().astype(np.float64)
        lagging = implicit + 0.5 * (explicit[:, None] * v * v).sum()
        power = (np.where(explicit[:, None] > 0.0, self._forces(state.x), 0.0) * v).sum(axis=1)
        pair = work.contacts.of_step()[0]["pair"]
        mass = np.bincount(self._body, explicit)
        of_bodies = dt[self.model.body_vert.numpy()[:-1]]
        mass[np.unique(pair[pair < len(mass)])] = 0.0
        mass[self._body[self.model.inv_mass.numpy() == 0.0]] = 0.0
        fall = (mass * of_bodies**2).sum() * np.square(self.model.gravity).sum()
        return float(lagging + 0.5 * (dt * power).sum() + 0.125 * fall)

    def _lumped(self, work: Work) -> np.ndarray:
        """Vertices of bodies that take explicit steps beside implicit ones, a mask, (n_vert,)."""
        if not work.implicit.explicit:
            return np.zeros(self.model.n_vert, dtype=bool)
        moving = self._body[work.implicit.explicit.inv_mass.numpy() > 0.0]
        return np.isin(self._body, moving)

    def _forces(self, x: wp.array) -> np.ndarray:
        """Internal forces and weight [N] of the mobile vertices, shape (n_vert, 3)."""
        model = self.model
        f_tet = wp.zeros(4 * model.n_tet, dtype=wp.vec3)
        f = wp.zeros(model.n_vert, dtype=wp.vec3)
        internal_forces(model, x, wp.full(model.n_tet, 1, dtype=int), f_tet)
        wp.launch(
            motion.gather,
            dim=model.n_vert,
            inputs=[model.vt_start, model.vt_corner, f_tet],
            outputs=[f],
        )
        total = f.numpy() + self.mass[:, None] * np.array(model.gravity)
        return np.where(model.inv_mass.numpy()[:, None] > 0.0, total, 0.0)

    def forces(self, work: Work, duration: float) -> dict[tuple[str, str], float]:
        """Mean force between the bodies of each touching pair [N], in the order of the bodies."""
        key = work.forces.pair_key.numpy()
        total = work.forces.pair_total.numpy()[:, :3] * work.forces.unit
        out = {}
        for k in np.argsort(key):
            if key[k] >= 0 and duration > 0.0:
                pair = self.names[key[k] >> 32], self.names[key[k] & 0xFFFFFFFF]
                out[pair] = float(np.linalg.norm(total[k]) / duration)
        return out

    def overlap(self, x: wp.array, work: Work) -> tuple[float, tuple[str, str] | None, int]:
        """Deepest overlap [m], the labels of its bodies, and the number of ``unheld`` vertices."""
        model = self.model
        trees = self._trees
        trees.refit(x, x)
        at_vert = wp.zeros(model.n_surf, dtype=float), wp.zeros(model.n_surf, dtype=int)
        at_edge = wp.zeros(model.n_edge, dtype=float), wp.zeros(model.n_edge, dtype=int)
        wp.launch(
            kernels.vertex_overlaps,
            dim=model.n_surf,
            inputs=[trees.volumes.id, trees.mesh, model.surf, model.body_world]
            + [self._partners, x],
            outputs=list(at_vert),
        )
        wp.launch(
            kernels.edge_overlaps,
            dim=model.n_edge,
            inputs=[trees.bodies.id, trees.mesh, model.body_world, self._partners, x],
            outputs=list(at_edge),
        )
        depth = np.concatenate([at_vert[0].numpy(), at_edge[0].numpy()])
        partner = np.concatenate([at_vert[1].numpy(), at_edge[1].numpy()])
        first = np.concatenate([model.surf.numpy(), model.edges.numpy()[:, 0]])
        k = int(depth.argmax())
        if depth[k] <= 0.0:
            return 0.0, None, 0
        own = model.vert_body.numpy()[first]
        awake = work.awake.bodies.numpy()[own] == 1  # those asleep are held
        deep = awake & (depth > UNHELD * model.body_edge.numpy()[own])
        unheld = np.setdiff1d(first[: model.n_surf][deep[: model.n_surf]], _held(work))
        return float(depth[k]), (self.names[own[k]], self.names[partner[k]]), len(unheld)

    def self_overlap(self, x: wp.array) -> tuple[float, str | None]:
        """Deepest overlap of a body with itself [m], and its label; after ``overlap`` of that x."""
        model = self.model
        trees = self._trees
        at_vert, at_edge = (wp.zeros(n, dtype=float) for n in (model.n_surf, model.n_edge))
        tets = trees.volumes.id, trees.mesh
        wp.launch(
            own.vertex_self_overlaps,
            dim=model.n_surf,
            inputs=[*tets, model.surf, model.body_world, x],
            outputs=[at_vert],
        )
        wp.launch(
            own.edge_self_overlaps,
            dim=model.n_edge,
            inputs=[*tets, model.body_world, x],
            outputs=[at_edge],
        )
        depth = np.concatenate([at_vert.numpy(), at_edge.numpy()])
        first = np.concatenate([model.surf.numpy(), model.edges.numpy()[:, 0]])
        k = int(depth.argmax())
        if depth[k] <= 0.0:
            return 0.0, None
        return float(depth[k]), self.names[model.vert_body.numpy()[first[k]]]


def _held(work: Work) -> np.ndarray:
    """Vertices that a contact of the last step moved out of another body or plane."""
    looked = first(work.contacts.record, int(work.contacts.n.numpy()[0]))  # a second time, or once
    contacts = np.concatenate([looked, work.contacts.of_step()[0]])
    own = contacts["vert"][:, :2]  # the others are those of the other side
    return own[contacts["coef"][:, :2] != 0.0]
