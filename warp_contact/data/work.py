"""Everything that a step fills, allocated once and kept until a capacity has to grow."""

from dataclasses import dataclass

import warp as wp

from warp_contact.data import (
    broad_phase,
    contact_forces,
    contacts,
    damping,
    implicit,
    narrow_phase,
    overflow,
    rebound,
    scan,
    surface,
    sweeps,
    warm_start,
)
from warp_contact.data.model import Model
from warp_contact.data.state import Awake, State
from warp_contact.data.structs import mesh_of, mobilities_of, n_world, worlds_of
from warp_contact.data.ties import TieWork
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.mobility import Mobility
from warp_contact.kernels.worlds import Worlds


@dataclass
class Work:
    """Rewritten in each step, except for ``warm``, the broad phase and the forces of the frame.

    Attributes:
        capacity: of the lists
        overflow: what did not fit
        dt: the step of each vertex, that of its world [s], shape (n_vert,)
        steps: how many the frame still has, shape (1,)
        awake: what moves
        mesh: what the search for contacts reads of the model
        mobility: how vertices answer impulses
        worlds: those that do not depend on each other
        scan: scratch of running sums
        f_tet: forces on the corners of each tet [N], shape (4 n_tet,)
        x: predicted positions, then those before the search [m], shape (n_vert,)
        damping: of damped bodies that take explicit steps; None where there are none
        implicit: of bodies that take implicit steps; None where none does
        broad_phase: which pairs may touch
        narrow_phase: intermediate results on the way to the contacts
        contacts: the contacts of the step
        sweeps: state of the sweeps over them
        surface: scratch of the search for the contact surface
        forces: what contact did in the frame
        warm: the impulses of the last step
        ties: the attachments; None where there is none
        rebound: of impacts; None where no body has a coefficient of restitution
    """

    capacity: overflow.Capacity
    overflow: overflow.Overflow
    dt: wp.array[float]
    steps: wp.array[int]
    awake: Awake
    mesh: Mesh
    mobility: Mobility
    worlds: Worlds
    scan: list[wp.array[int]]
    f_tet: wp.array[wp.vec3]
    x: wp.array[wp.vec3]
    damping: damping.Damping | None
    implicit: implicit.ImplicitWork | None
    broad_phase: broad_phase.BroadPhase
    narrow_phase: narrow_phase.NarrowPhase
    contacts: contacts.Contacts
    sweeps: sweeps.Sweeps
    surface: surface.Surface
    forces: contact_forces.ContactForces
    warm: warm_start.WarmStart
    ties: TieWork | None
    rebound: rebound.Rebound | None


def everything(model: Model) -> Awake:
    """Nothing sleeps."""
    return Awake(
        bodies=wp.full(model.n_body, 1, dtype=int),
        tets=wp.full(model.n_tet, 1, dtype=int),
        inv_mass=model.inv_mass,
    )


def allocate_work(
    model: Model,
    state: State,
    capacity: overflow.Capacity,
    awake: Awake | None = None,
    unit: float = 1.0,
    shapes: implicit.Shapes | None = None,
    ties: TieWork | None = None,
) -> Work:
    """Allocate for a step on the current device; the Bvhs are built around ``state.x``.

    ``unit`` is the resolution of the recorded impulses [N s], ``awake`` what moves, None for
    everything, ``shapes`` and ``ties`` of implicit bodies and attachments, None where none is.
    """
    n, m, awake = model.n_vert, capacity.contacts, awake or everything(model)
    broad = broad_phase.allocate(model, state.x, capacity)
    narrow = narrow_phase.allocate(capacity, n_world(model))
    of_surface = surface.allocate(n_world(model), model.n_body, n, model.n_tet, m)
    forces = contact_forces.allocate(n, capacity.pairs, n_world(model), unit)
    return Work(
        capacity=capacity,
        overflow=overflow.allocate(),
        dt=wp.zeros(n, dtype=float),
        steps=wp.zeros(1, dtype=int),
        awake=awake,
        mesh=mesh_of(model, broad.surface),
        mobility=mobilities_of(model, rows=shapes is not None),
        worlds=worlds_of(model, of_surface, narrow.has_new, forces.unsolved),
        scan=scan.allocate(
            max(2 * n + 2, model.n_edge + 1, capacity.verts + 1, capacity.edges + 1)
        ),
        f_tet=wp.zeros(4 * model.n_tet, dtype=wp.vec3),
        x=wp.zeros(n, dtype=wp.vec3),
        damping=damping.allocate(shapes.explicit if shapes else model),
        implicit=implicit.allocate(model, shapes, awake, m) if shapes else None,
        broad_phase=broad,
        narrow_phase=narrow,
        contacts=contacts.allocate(n, m, narrow.n_inside),
        sweeps=sweeps.allocate(n, m),
        surface=of_surface,
        forces=forces,
        warm=warm_start.allocate(n, m, shapes is not None),
        ties=ties,
        rebound=None,
    )


def let_rebound(work: Work) -> None:
    """Allocate what impacts need, where there is none yet."""
    if not work.rebound:
        n_body = len(work.awake.bodies)
        work.rebound = rebound.allocate(len(work.dt), n_body, work.contacts, work.worlds)


def forget(work: Work) -> None:
    """Clear what a step takes over from the last one."""
    warm_start.forget(work.warm)
    damping.forget(work.damping)
    contact_forces.clear(work.forces)
    work.contacts.n.zero_()
    work.contacts.kept.n.fill_(-1)
    work.broad_phase.stale.fill_(1)
