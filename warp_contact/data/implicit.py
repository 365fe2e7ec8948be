"""What the steps of implicit bodies need: their mobilities, and scratch of a step."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.state import Awake
from warp_contact.kernels.implicit.advance import Drift
from warp_contact.kernels.implicit.bodies import (
    HELD,
    RIGID,
    Implicit,
    RigidMotion,
    Solids,
    mat3x12,
)
from warp_contact.kernels.implicit.settle import Settling
from warp_contact.kernels.implicit.solve import Iteration
from warp_contact.kernels.impulse.rows import Shares, Touched
from warp_contact.kernels.mobility import Mobility


@dataclass(frozen=True)
class Shapes:
    """Which bodies take implicit steps, and which of them share a shape.

    Those that are lumped have a form and moments too, for forces from outside.

    Attributes:
        kind: of each body, see ``kernels/implicit/bodies.py``, shape (n_body,)
        of_body: number of the shape of each body, -1 for none, shape (n_body,)
        placed: rotation of its mesh when it was placed, shape (n_body, 3, 3)
        first: first block of each shape, and the number of all, shape (n_shape + 1,)
        rest: vertices of the shape of each body from its centre of mass [m], shape (n_vert, 3)
        inertia: moments of inertia about it [kg m^2], shape (n_body, 3, 3)
        force, torque: that act on bodies from outside [N], [N m], shape (n_body,)
        too_large: bodies that take explicit steps beside the others, a mask, shape (n_body,)
        explicit: the model with the tets of these alone, where only they move
        deforming: the model with the tets of the others
    """

    kind: np.ndarray
    of_body: np.ndarray
    placed: np.ndarray
    first: np.ndarray
    rest: np.ndarray
    inertia: np.ndarray
    force: wp.array
    torque: wp.array
    too_large: np.ndarray
    explicit: Model
    deforming: Model


@dataclass
class ImplicitWork:
    """Allocated only where some body takes implicit steps.

    Attributes:
        bodies: what kernels know of them
        deforming: the model with their tets alone
        explicit: that of bodies that take explicit steps beside them; None where none does
        x: positions at which the mobilities are [m], shape (n_vert,)
        any_deforming: whether some of them deform; else none of the stages for these run
        any_held: whether some of them have fixed vertices
        soft: the mobilities of vertices that are not of rigid bodies
        gradient: deformation gradient times volume of each tet [m^3], shape (n_tet,)
        stiff, damped: corners of K p and C p [N], shape (4 n_tet,); ``damped`` is empty without
        f: forces [N], shape (n_vert,)
        r, z, p, ap, dv: of the conjugate gradients, shape (n_vert,)
        y: R^T P^T p, shape (n_vert,)
        impulse, answer: impulses on the vertices, and how they answer, shape (n_vert,)
        before: velocities or positions before the sweeps, shape (n_vert,)
        predicted: velocities without the contacts of the step, shape (n_vert,)
        total: impulses of its contacts so far, shape (n_vert,)
        share: of the vertices in their contacts
        touched: vertices of each body with contacts
        counted: contacts in the row sums, shape (contacts,)
        ahead: extrapolated pushes of the closure [kg m], shape (contacts,)
        by, of, rest: rigid motions by impulses, of velocities, and at rest
        busy: 1 where a body has anything to answer, shape (n_body,)
        kept: motion of each body before the closure
        spin: its angular momentum then, about its centre [kg m^2/s], shape (n_body,)
        drift: how bodies turn in a step
        iteration: where the iterations are
        running: bodies that still iterate, shape (1,)
        settling: where the passes are by which strained bodies answer
        unsettled: bodies that need another of these, shape (1,)
        none, every: empty arrays
    """

    bodies: Implicit
    deforming: Model
    explicit: Model | None
    x: wp.array[wp.vec3]
    any_deforming: bool
    any_held: bool
    soft: Mobility
    gradient: wp.array[wp.mat33]
    stiff: wp.array[wp.vec3]
    damped: wp.array[wp.vec3]
    f: wp.array[wp.vec3]
    r: wp.array[wp.vec3]
    z: wp.array[wp.vec3]
    p: wp.array[wp.vec3]
    ap: wp.array[wp.vec3]
    dv: wp.array[wp.vec3]
    y: wp.array[wp.vec3]
    impulse: wp.array[wp.vec3]
    answer: wp.array[wp.vec3]
    before: wp.array[wp.vec3]
    predicted: wp.array[wp.vec3]
    total: wp.array[wp.vec3]
    share: Shares
    touched: Touched
    counted: wp.array[int]
    ahead: wp.array[float]
    by: RigidMotion
    of: RigidMotion
    rest: RigidMotion
    busy: wp.array[int]
    kept: RigidMotion
    spin: wp.array[wp.vec3d]
    drift: Drift
    iteration: Iteration
    running: wp.array[int]
    settling: Settling
    unsettled: wp.array[int]
    none: wp.array[wp.vec3]
    every: wp.array[int]


def allocate(model: Model, shapes: Shapes, awake: Awake, n_contact: int) -> ImplicitWork:
    """Allocate for the bodies that take implicit steps; ``set_blocks`` gives the mobilities."""
    n, n_tet = model.n_vert, model.n_tet
    damped = any(e.damped for e in shapes.deforming.elements)
    names = ["x", "f", "r", "z", "p", "ap", "dv", "y", "impulse", "answer", "before"]
    names += "predicted", "total"
    vectors = {k: wp.zeros(n, dtype=wp.vec3) for k in names}
    return ImplicitWork(
        bodies=_bodies(model, shapes, awake),
        deforming=shapes.deforming,
        explicit=shapes.explicit if shapes.too_large.any() else None,
        any_deforming=bool((shapes.of_body >= 0).any()),
        any_held=bool((shapes.kind == int(HELD)).any()),
        soft=_soft(model, shapes),
        gradient=wp.zeros(n_tet, dtype=wp.mat33),
        stiff=wp.zeros(4 * n_tet, dtype=wp.vec3),
        damped=wp.zeros(4 * n_tet if damped else 0, dtype=wp.vec3),
        share=_shares(model),
        touched=_touched(model),
        counted=wp.zeros(n_contact, dtype=int),
        ahead=wp.zeros(n_contact, dtype=float),
        by=_rigid(model.n_body),
        of=_rigid(model.n_body),
        rest=_rigid(model.n_body),
        busy=wp.zeros(model.n_body, dtype=int),
        kept=_rigid(model.n_body),
        spin=wp.zeros(model.n_body, dtype=wp.vec3d),
        drift=_drift(model.n_body, any(model.solids)),
        iteration=_iteration(model.n_body),
        running=wp.zeros(1, dtype=int),
        settling=_settling(model.n_body),
        unsettled=wp.zeros(1, dtype=int),
        none=wp.zeros(0, dtype=wp.vec3),
        every=wp.zeros(0, dtype=int),
        **vectors,
    )


def set_blocks(
    work: ImplicitWork,
    shapes: Shapes,
    h: np.ndarray,
    first: np.ndarray,
    blocks: np.ndarray,
    norms: np.ndarray,
) -> bool:
    """Set the blocks (n, 3, 12) [1/kg] of all shapes, one set for each length of the step.

    ``norms`` are theirs (n, 4), ``h`` the step of each body [s], ``first`` where its set begins;
    both (n_body,). Returns whether arrays had to be replaced by larger ones.
    """
    d = work.bodies
    d.h.assign(h.astype(np.float32))
    d.first.assign(first + np.where(shapes.of_body >= 0, shapes.first[shapes.of_body], 0))
    larger = len(norms) > d.norm.shape[0]
    if larger:
        d.block = wp.array(blocks, dtype=mat3x12)
        d.norm = wp.array(norms, dtype=wp.vec4)
    elif len(norms):
        d.block[: len(norms)].assign(blocks)
        d.norm[: len(norms)].assign(norms)
    return larger


def _bodies(model: Model, shapes: Shapes, awake: Awake) -> Implicit:
    d, n = Implicit(), model.n_body
    d.h = wp.ones(n, dtype=float)
    d.kind = wp.array(shapes.kind, dtype=int)
    d.awake, d.body_vert, d.vert_body = awake.bodies, model.body_vert, model.vert_body
    d.mass, d.inv_mass = model.mass, model.inv_mass
    d.first = wp.zeros(n, dtype=int)
    n_block = int(shapes.first[-1])
    d.block, d.norm = wp.zeros(n_block, dtype=mat3x12), wp.zeros(n_block, dtype=wp.vec4)
    d.placed = wp.array(shapes.placed, dtype=wp.mat33)
    d.rest = wp.array(shapes.rest, dtype=wp.vec3)
    inverse = [np.linalg.inv(i) if i.any() else i for i in shapes.inertia]
    d.rest_inertia = wp.array(np.array(inverse), dtype=wp.mat33)
    d.force, d.torque = shapes.force, shapes.torque
    d.turn = wp.zeros(model.n_vert, dtype=wp.mat33)
    d.centre = wp.zeros(n, dtype=wp.vec3)
    d.inv_total = wp.zeros(n, dtype=float)
    d.inv_inertia = wp.zeros(n, dtype=wp.mat33)
    d.solids = _solids(model, shapes)
    return d


def _solids(model: Model, shapes: Shapes) -> Solids:
    n = model.n_body if any(model.solids) else 0
    inertia, spread, of_vertices = (np.tile(np.eye(3), (n, 1, 1)) for _ in range(3))
    middle, start = np.zeros((n, 3)), model.body_vert.numpy()
    for b in np.flatnonzero(shapes.kind == int(RIGID)):
        own = slice(start[b], start[b + 1])
        q = shapes.rest[own].astype(np.float32).astype(float)  # as kernels have it
        m = model.mass.numpy()[own].astype(float)
        middle[b] = np.average(q, axis=0, weights=m)
        s = q - middle[b]
        spread[b] = (m[:, None] * s).T @ s
        of_vertices[b] = np.trace(spread[b]) * np.eye(3) - spread[b]
        inertia[b] = shapes.inertia[b]
    solids = Solids()
    solids.inertia = wp.array(inertia, dtype=wp.mat33d)
    solids.inverse = wp.array(np.linalg.inv(inertia), dtype=wp.mat33d)
    solids.middle = wp.array(middle, dtype=wp.vec3d)
    solids.spread = wp.array(np.linalg.inv(spread), dtype=wp.mat33d)
    solids.inverse_of_vertices = wp.array(np.linalg.inv(of_vertices), dtype=wp.mat33d)
    solids.turn = wp.zeros(n, dtype=wp.mat33d)
    solids.at, solids.v, solids.w = (wp.zeros(n, dtype=wp.vec3d) for _ in range(3))
    return solids


def _rigid(n_body: int) -> RigidMotion:
    motion = RigidMotion()
    motion.v, motion.w = (wp.zeros(n_body, dtype=wp.vec3) for _ in range(2))
    return motion


def _drift(n_body: int, any_rigid: bool) -> Drift:
    drift = Drift()
    n = n_body if any_rigid else 0
    drift.centre, drift.rate = (wp.zeros(n, dtype=wp.vec3d) for _ in range(2))
    drift.lies = wp.zeros(n, dtype=wp.mat33d)
    drift.turn, drift.w = wp.zeros(n_body, dtype=wp.mat33), wp.zeros(n_body, dtype=wp.vec3)
    return drift


def _iteration(n_body: int) -> Iteration:
    it = Iteration()
    it.going = wp.zeros(n_body, dtype=int)
    it.enough, it.now = (wp.zeros(n_body, dtype=wp.float64) for _ in range(2))
    return it


def _settling(n_body: int) -> Settling:
    to = Settling()
    to.left, to.passes = wp.zeros(n_body, dtype=float), wp.zeros(1, dtype=int)
    return to


def _soft(model: Model, shapes: Shapes) -> Mobility:
    soft = Mobility()
    rigid = (shapes.kind == int(RIGID))[model.vert_body.numpy()]
    soft.inv_mass = wp.array(np.where(rigid, 0.0, model.inv_mass.numpy()), dtype=float)
    soft.row = wp.zeros(0, dtype=float)
    return soft


def _shares(model: Model) -> Shares:
    share = Shares()
    share.of_vert, share.by = (wp.zeros(model.n_vert, dtype=float) for _ in range(2))
    share.n = wp.zeros(model.n_body, dtype=int)
    share.vert = wp.zeros(model.n_vert, dtype=int)
    return share


def _touched(model: Model) -> Touched:
    touched = Touched()
    touched.n = wp.zeros(model.n_body, dtype=int)
    touched.vert = wp.zeros(model.n_vert, dtype=int)
    return touched
