"""Attachments between bodies as arrays: their table, and what steps need of them."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_contact.data import motors
from warp_contact.data.model import Model
from warp_contact.data.tie_table import TieTable
from warp_contact.kernels.implicit.bodies import RigidMotion
from warp_contact.kernels.ties.attachment import Attachments, Partners
from warp_contact.kernels.ties.motor import Motors, find_places
from warp_contact.kernels.ties.rows import Rows
from warp_contact.kernels.ties.tie import Tied, Ties, vec8, vec8i

SLOTS = 256  # vertices of a cluster with contacts that have row sums of their own, at most


@dataclass
class TieWork:
    """Allocated only where bodies are attached; it stays when the other buffers are replaced.

    Attributes:
        n, n_cluster, n_attachment, n_vert: numbers of ties, clusters, attachments, tied vertices
        ties: all ties
        tied: the vertices that have them
        attachments: forces and limits
        partners: which bodies each body is attached to
        rows: row sums of contacts on them
        motors: what drives them
        driven: whether a motor drives any
        attached: 1 for a body that is attached to anything, shape (n_body,)
        no_edges: an empty array
    """

    n: int
    n_cluster: int
    n_attachment: int
    n_vert: int
    ties: Ties
    tied: Tied
    attachments: Attachments
    partners: Partners
    rows: Rows
    motors: Motors
    attached: wp.array[int]
    no_edges: wp.array[wp.vec4i]
    driven: bool = False

    def copied(self) -> dict[str, wp.array]:
        """What a frame changes: what is broken, impulses [N s], motors; in arrays of their own."""
        return {name: wp.clone(array) for name, array in self._kept().items()}

    def copy(self, kept: dict[str, wp.array]) -> None:
        """Put back what was ``copied``."""
        for name, array in self._kept().items():
            wp.copy(array, kept[name])

    def places(self, x: wp.array) -> wp.array:
        """Where hinges [rad] and sliders [m] are, 0 for others, shape (n_attachment,); new."""
        out = wp.zeros(self.n_attachment, dtype=float)
        inputs = [x, self.attachments, self.motors, self.ties]
        wp.launch(find_places, len(self.motors.which), inputs=inputs, outputs=[out])
        return out

    def values(self) -> dict[str, np.ndarray]:
        """What a checkpoint needs."""
        return {name: array.numpy() for name, array in self._kept().items()}

    def restore(self, **values: np.ndarray) -> None:
        """Take over what ``values`` gave."""
        for name, array in self._kept().items():
            array.assign(values[name])
        self.driven = bool(values["limit"].any())

    def _kept(self) -> dict[str, wp.array]:
        of = self.attachments
        return {"broken": of.broken, "impulse": of.impulse} | motors.arrays(self.motors)

    def mend(self, which: np.ndarray) -> None:
        """Let attachments, a mask, hold as at the start, without motors, and forget forces."""
        values = self.values()
        for name in values:
            values[name] = values[name].copy()
            values[name][which] = 0
        self.restore(**values)


def allocate(model: Model, lumped: np.ndarray) -> TieWork | None:
    """Allocate for the attachments of a model; None where there is none.

    Bodies that are ``lumped``, a mask, take explicit steps.
    """
    table = model.ties
    if table is None:
        return None
    attachments, tied = _attachments(table), _tied(model, table)
    return TieWork(
        n=len(table.vert),
        n_cluster=len(table.first) - 1,
        n_attachment=len(table.body),
        n_vert=len(tied.vert),
        ties=_ties(table, attachments.broken),
        tied=tied,
        attachments=attachments,
        partners=_partners(model, table, attachments.broken),
        rows=_rows(model, table, lumped),
        motors=motors.allocate(table, model.n_body),
        attached=wp.array(np.isin(np.arange(model.n_body), table.body), dtype=int),
        no_edges=wp.zeros(0, dtype=wp.vec4i),
    )


def _rows(model: Model, table: TieTable, lumped: np.ndarray) -> Rows:
    start = model.body_vert.numpy()
    mobile = np.maximum.reduceat(model.inv_mass.numpy(), start[:-1]) > 0.0
    of_cluster = []
    for k in range(len(table.first) - 1):
        whose = np.unique(table.attachment[table.cluster == k])
        bodies = np.unique(table.body[whose])
        bodies = bodies[(bodies >= 0) & mobile[bodies]]
        of_cluster.append(bodies[:0] if lumped[bodies].any() else bodies)
    sizes = np.diff(start)
    slots = np.array([min(SLOTS, int(sizes[bodies].sum())) for bodies in of_cluster])
    rows = Rows()
    rows.body = wp.array(np.concatenate(of_cluster), dtype=int)
    rows.first_body = _starts([len(bodies) for bodies in of_cluster])
    rows.first = _starts(slots)
    rows.cluster = wp.array(np.repeat(np.arange(len(slots)), slots), dtype=int)
    rows.column, rows.block = _starts(slots * np.diff(table.first)), _starts(slots**2)
    rows.n, rows.vert = (wp.zeros(n, dtype=int) for n in (len(slots), int(slots.sum())))
    rows.columns = wp.zeros(int((slots * np.diff(table.first)).sum()), dtype=wp.mat33d)
    rows.norms = wp.zeros(int((slots**2).sum()), dtype=float)
    return rows


def _starts(sizes) -> wp.array:
    return wp.array(np.concatenate([[0], np.cumsum(sizes)]), dtype=int)


def _ties(table: TieTable, broken: wp.array) -> Ties:
    n, sizes = len(table.vert), np.diff(table.first)
    ties = Ties()
    ties.vert = wp.array(table.vert, dtype=vec8i)
    ties.weight, ties.now = (wp.array(table.weight, dtype=vec8) for _ in range(2))
    ties.along = wp.array(table.along, dtype=vec8)
    ties.axis, ties.point, ties.at = (
        wp.array(a, dtype=wp.vec3) for a in (table.axis, table.point, table.point)
    )
    ties.line = wp.zeros(n, dtype=wp.vec3)
    ties.slides, ties.to_world = (wp.array(a, dtype=int) for a in (table.slides, table.to_world))
    ties.number = wp.array(np.bincount(table.attachment)[table.attachment], dtype=int)
    ties.compliance = wp.array(table.compliance, dtype=float)
    ties.attachment, ties.cluster, ties.first = (
        wp.array(a, dtype=int) for a in (table.attachment, table.cluster, table.first)
    )
    blocks = np.concatenate([[0], np.cumsum(sizes**2)])
    ties.block = wp.array(blocks[:-1], dtype=int)
    ties.matrix = wp.zeros(int(blocks[-1]), dtype=wp.mat33d)
    ties.broken, ties.state = broken, wp.zeros(n, dtype=int)
    ties.soft = wp.zeros(n, dtype=wp.float64)
    for name in ("pull", "since", "held", "before", "added", "asked"):
        setattr(ties, name, wp.zeros(n, dtype=wp.vec3d))
    ties.moved, ties.singular = (wp.zeros(len(sizes), dtype=int) for _ in range(2))
    return ties


def _tied(model: Model, table: TieTable) -> Tied:
    """The vertices with a weight in any tie, and in which."""
    of_tie = ((table.weight != 0.0) | (table.along != 0.0)).ravel()
    entry = np.flatnonzero(of_tie)
    vert = table.vert.ravel()[entry]
    order = np.lexsort((entry, vert))
    verts, first = np.unique(vert[order], return_index=True)
    tied = Tied()
    tied.vert = wp.array(verts, dtype=int)
    tied.first = wp.array(np.append(first, len(entry)), dtype=int)
    tied.entry = wp.array(entry[order], dtype=int)
    tied.start = wp.array(np.searchsorted(verts, model.body_vert.numpy()), dtype=int)
    tied.p, tied.z = (wp.zeros(model.n_vert, dtype=wp.vec3) for _ in range(2))
    tied.busy = wp.zeros(model.n_body, dtype=int)
    tied.motion = RigidMotion()
    tied.motion.v, tied.motion.w = (wp.zeros(model.n_body, dtype=wp.vec3) for _ in range(2))
    return tied


def _attachments(table: TieTable) -> Attachments:
    of = Attachments()
    of.body = wp.array(table.body, dtype=wp.vec2i)
    of.tie = wp.array(np.argsort(table.attachment, kind="stable"), dtype=int)
    number = np.bincount(table.attachment, minlength=len(table.body))
    of.first = wp.array(np.concatenate([[0], np.cumsum(number)]), dtype=int)
    of.limit = wp.array(table.limit, dtype=float)
    of.broken = wp.zeros(len(table.body), dtype=int)
    of.impulse = wp.zeros(len(table.body), dtype=wp.vec3d)
    return of


def _partners(model: Model, table: TieTable, broken: wp.array) -> Partners:
    own = table.body.T.ravel()
    other, by = table.body[:, ::-1].T.ravel(), np.tile(np.arange(len(table.body)), 2)
    order = np.argsort(own, kind="stable")
    order = order[own[order] >= 0]
    partners = Partners()
    partners.body, partners.by = (wp.array(a[order], dtype=int) for a in (other, by))
    start = np.searchsorted(own[order], np.arange(model.n_body + 1))
    partners.start, partners.broken = wp.array(start, dtype=int), broken
    return partners
