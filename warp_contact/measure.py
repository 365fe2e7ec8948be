"""Energies, momenta, overlaps and contact forces of a state, for people and for tests."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_contact import topology
from warp_contact.forces import energies, internal_forces
from warp_contact.kernels import measure as kernels
from warp_contact.kernels import motion
from warp_contact.types import Model, State
from warp_contact.work import Work, launch_body_boxes, launch_triangle_boxes


@dataclass(frozen=True)
class Measure:
    """One frame in numbers.

    Attributes:
        kinetic: energy [J] at the time of the frame; the velocities of symplectic Euler are those
            of half a step earlier, so h/2 times the power of forces and gravity is added
        elastic: energy [J]
        gravitational: energy against the origin [J]
        momentum: [kg m/s], shape (3,)
        angular_momentum: about the origin [kg m^2/s], shape (3,)
        overlap: deepest overlap of a vertex or an edge [m]
        overlap_pair: labels of its bodies, None without overlap
        n_contacts: contacts in the last step
        volume_ratio: smallest volume of a tet over its rest volume
        forces: mean contact force of the frame between two bodies, by their labels [N]
    """

    kinetic: float
    elastic: float
    gravitational: float
    momentum: np.ndarray
    angular_momentum: np.ndarray
    overlap: float
    overlap_pair: tuple[str, str] | None
    n_contacts: int
    volume_ratio: float
    forces: dict[tuple[str, str], float]

    @property
    def energy(self) -> float:
        """Kinetic, elastic and gravitational energy [J]."""
        return self.kinetic + self.elastic + self.gravitational


class Meter:
    """Measures states of one model; its memory is allocated at the first use."""

    def __init__(self, model: Model):
        """Read what stays constant."""
        self.model = model
        self.mass = model.mass.numpy().astype(np.float64)
        self.names = [*model.labels, *(f"plane{p}" for p in range(model.n_plane))]
        self._tets = model.tets.numpy()
        self._volume = model.volume.numpy()
        self._bvhs = None

    def measure(self, state: State, work: Work, unit: float, duration: float, dt: float) -> Measure:
        """Measure a state; impulses were recorded for ``duration`` [s] in steps of ``dt`` [s]."""
        model = self.model
        x = state.x.numpy().astype(np.float64)
        v = state.v.numpy().astype(np.float64)
        energy = wp.zeros(model.n_tet, dtype=float)
        energies(model, state.x, energy)
        p = self.mass[:, None] * v
        overlap, pair = self.overlap(state.x)
        return Measure(
            kinetic=float(0.5 * (p * v).sum() + 0.5 * dt * (self._forces(state.x, work) * v).sum()),
            elastic=float(energy.numpy().sum(dtype=np.float64)),
            gravitational=float(-(self.mass @ x) @ np.array(model.gravity)),
            momentum=p.sum(axis=0),
            angular_momentum=np.cross(x, p).sum(axis=0),
            overlap=overlap,
            overlap_pair=pair,
            n_contacts=int((work.contacts.coef.numpy()[: self._n(work)] != 0.0).any(1).sum()),
            volume_ratio=float((topology.signed_volumes(x, self._tets) / self._volume).min()),
            forces=self.forces(work, unit, duration),
        )

    def _forces(self, x: wp.array, work: Work) -> np.ndarray:
        """Internal forces and weight [N] of mobile vertices without contact, shape (n_vert, 3)."""
        model = self.model
        f_tet = wp.zeros((model.n_tet, 4), dtype=wp.vec3)
        f = wp.zeros(model.n_vert, dtype=wp.vec3)
        internal_forces(model, x, wp.full(model.n_tet, 1, dtype=int), f_tet)
        wp.launch(
            motion.gather,
            dim=model.n_vert,
            inputs=[model.vt_start, model.vt_corner, f_tet],
            outputs=[f],
        )
        total = f.numpy() + self.mass[:, None] * np.array(model.gravity)
        free = (model.inv_mass.numpy() > 0.0) & ~work.impulse.numpy().any(axis=1)
        return np.where(free[:, None], total, 0.0)

    def forces(self, work: Work, unit: float, duration: float) -> dict[tuple[str, str], float]:
        """Mean force between the bodies of each touching pair [N], in the order of the bodies."""
        key = work.pair_key.numpy()
        total = work.pair_total.numpy() * unit
        out = {}
        for k in np.argsort(key):
            if key[k] >= 0 and duration > 0.0:
                pair = self.names[key[k] >> 32], self.names[key[k] & 0xFFFFFFFF]
                out[pair] = float(np.linalg.norm(total[k]) / duration)
        return out

    def overlap(self, x: wp.array) -> tuple[float, tuple[str, str] | None]:
        """Deepest overlap [m] and the labels of its bodies."""
        model = self.model
        bodies, surface, volumes = self._refit(x)
        at_vert = wp.zeros(model.n_surf, dtype=float), wp.zeros(model.n_surf, dtype=int)
        at_edge = wp.zeros(model.n_edge, dtype=float), wp.zeros(model.n_edge, dtype=int)
        wp.launch(
            kernels.vertex_overlaps,
            dim=model.n_surf,
            inputs=[volumes.id, surface.id, model.surf, model.tets, model.tris]
            + [model.vert_body, model.body_world, model.body_edge]
            + [model.plane_n, model.plane_h, x],
            outputs=list(at_vert),
        )
        wp.launch(
            kernels.edge_overlaps,
            dim=model.n_edge,
            inputs=[bodies.id, surface.id, model.tris, model.edges, model.vert_body]
            + [model.body_world, model.body_edge, x],
            outputs=list(at_edge),
        )
        depth = np.concatenate([at_vert[0].numpy(), at_edge[0].numpy()])
        partner = np.concatenate([at_vert[1].numpy(), at_edge[1].numpy()])
        first = np.concatenate([model.surf.numpy(), model.edges.numpy()[:, 0]])
        k = int(depth.argmax())
        if depth[k] <= 0.0:
            return 0.0, None
        own = model.vert_body.numpy()[first[k]]
        return float(depth[k]), (self.names[own], self.names[partner[k]])

    def _refit(self, x: wp.array) -> tuple[wp.Bvh, wp.Bvh, wp.Bvh]:
        model = self.model
        if self._bvhs is None:
            sizes = model.n_body, model.n_tri, model.n_tet
            self._boxes = [(wp.zeros(n, dtype=wp.vec3), wp.zeros(n, dtype=wp.vec3)) for n in sizes]
            self._near = wp.full(model.n_body, 1, dtype=int)
            self._skin = wp.zeros(model.n_body, dtype=float)
        of_body, of_tri, of_tet = self._boxes
        launch_body_boxes(model, x, self._skin, *of_body)
        launch_triangle_boxes(model, x, self._skin, self._near, *of_tri)
        wp.launch(kernels.tet_boxes, dim=model.n_tet, inputs=[model.tets, x], outputs=list(of_tet))
        if self._bvhs is None:
            vert_body = model.vert_body.numpy()
            world = model.body_world.numpy()[vert_body[self._tets[:, 0]]]
            groups = model.body_world, model.tri_body, wp.array(world, dtype=int)
            self._bvhs = tuple(
                wp.Bvh(*box, groups=group) for box, group in zip(self._boxes, groups, strict=True)
            )
        for bvh in self._bvhs:
            bvh.refit()
        return self._bvhs

    @staticmethod
    def _n(work: Work) -> int:
        return int(work.contacts.n.numpy()[0])
