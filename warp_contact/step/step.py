"""One time step, read from top to bottom."""

import math
from functools import partial

import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.motion import motion
from warp_contact.step import broad_phase, depth, impulse, narrow_phase, surface
from warp_contact.step.forces import damp, internal_forces
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce


def step(
    model: Model,
    state: State,
    work: Work,
    response: ContactSurface | Penalty | PredictedForce,
    stages: int,
    search: bool,
    unit: float,
) -> None:
    """Advance ``state`` in place by ``work.dt``, symplectic Euler.

    No read-back and no allocation, so that a caller may capture it. ``stages`` are those of the
    damping, ``search`` says whether there may be overlaps that no step created, ``unit`` [N s] is
    the resolution of the recorded contact impulses.
    """
    c = work.contacts

    def exchange() -> None:
        impulse.exchange(model, state.v, work)
        impulse.keep_edges(work)

    def begin() -> None:
        arrange(model, state.x, work)
        impulse.recall(model, state.v, work)
        exchange()

    def touch() -> None:
        vertex_contacts(model, state.x, work.x, work, not search)
        hold_edges(model, state.x, work, search)
        wp.capture_if(c.n, begin, lambda: impulse.forget_edges(work))
        # The impulses may have led other edges across each other. Were these left to the closure,
        # they would go on to approach, and what it displaces would gain energy.
        drift(model, state, work, work.x)
        edge_contacts(model, state.x, work.x, work, not search, hold=True)
        surface.leftover(model, work.x, work)
        wp.capture_if(work.found[0:1], exchange)
        impulse.keep(work)
        impulse.record(work, unit)
        drift(model, state, work, state.x)
        # Where impulses were exchanged once more, ``found`` says so still: edges may have moved on.
        surface.leftover(model, state.x, work, strays=not search, more=True)
        move_surfaces(model, state, work, response, search)  # what the step did not create

    def fly() -> None:
        wp.copy(state.x, work.x)
        impulse.forget(work)

    if isinstance(response, Penalty):
        broad_phase.refresh(model, state.x, state.x, work)
        # Forces belong to the positions they act at.
        contacts(model, state.x, state.x, work, False)
        predict(model, state, work, stages)
        wp.capture_if(c.n, lambda: impulse.push(model, state.v, work, response))
        impulse.record(work, unit)
        drift(model, state, work, state.x)
    elif isinstance(response, PredictedForce):
        predict(model, state, work, stages)
        broad_phase.refresh(model, state.x, work.x, work)
        contacts(model, state.x, work.x, work, False)  # overlaps may last some steps
        wp.capture_if(c.n, lambda: impulse.push_apart(model, work.x, state.v, work))
        impulse.record(work, unit)
        drift(model, state, work, state.x)
    elif response.search == "literal":
        predict(model, state, work, stages)
        broad_phase.refresh(model, state.x, work.x, work)
        wp.copy(state.x, work.x)  # the paper: displacement first, then velocities
        contacts(model, state.x, state.x, work, False, edges=False)
        surface.leftover(model, state.x, work)
        move_surfaces(model, state, work, response, search)
        wp.capture_if(c.n, lambda: impulse.exchange(model, state.v, work))
        impulse.record(work, unit)
    else:
        predict(model, state, work, stages)
        broad_phase.refresh(model, state.x, work.x, work)
        wp.capture_if(work.candidates.some, touch, fly)


def steps(model: Model, state: State, work: Work, *others) -> None:
    """Take ``work.steps`` steps, with the arguments of ``step``; for a capture."""

    def one() -> None:
        step(model, state, work, *others)
        wp.launch(motion.count_down, dim=1, inputs=[work.contacts.needed], outputs=[work.steps])

    wp.capture_while(work.steps, one)


def overlaps(model: Model, state: State, work: Work) -> bool:
    """Whether bodies overlap by more than a search is worth; reads back, so not for a step.

    What did not fit was not looked at: see ``contacts.needed``.
    """
    work.dt.fill_(1.0)
    work.contacts.needed.zero_()
    broad_phase.refresh(model, state.x, state.x, work)
    contacts(model, state.x, state.x, work, False, edges=False)
    surface.leftover(model, state.x, work)
    return bool(work.found.numpy()[1])


def kick(model: Model, state: State, work: Work) -> None:
    """Add the acceleration by internal forces and gravity over ``work.dt`` to ``state.v``."""
    internal_forces(model, state.x, work.awake.tets, work.f_tet)
    wp.launch(
        motion.predict,
        dim=model.n_vert,
        inputs=[model.vt_start, model.vt_corner, work.f_tet, work.awake.inv_mass]
        + [wp.vec3(*model.gravity), work.dt, state.x, state.v],
        outputs=[work.x, state.v],
    )


def predict(model: Model, state: State, work: Work, stages: int) -> None:
    """Damp ``state.v``, kick it, set ``work.x`` = x + h v.

    In this order: damping after the kick would hand the forces of vertices at rest in a contact on
    to their neighbours before the impulses see them, and rest would depend on the damping.
    """
    if stages > 0:
        scratch, inv_mass = (work.v, work.s), work.awake.inv_mass
        damp(model, state.x, state.v, inv_mass, work.dt, work.f_tet, scratch, stages, work.share)
    kick(model, state, work)


def drift(model: Model, state: State, work: Work, out: wp.array) -> None:
    """Set ``out`` = x + h v."""
    wp.launch(motion.advance, dim=model.n_vert, inputs=[work.dt, state.x, state.v], outputs=[out])


def contacts(
    model: Model, x0: wp.array, x: wp.array, work: Work, fresh: bool, edges: bool = True
) -> None:
    """Stages 1 and 2: contacts at the positions ``x``, in a step from ``x0``."""
    vertex_contacts(model, x0, x, work, fresh)
    if edges:
        edge_contacts(model, x0, x, work, fresh)
    wp.capture_if(work.contacts.n, partial(arrange, model, x0, work))


def arrange(model: Model, x0: wp.array, work: Work, first: wp.array | None = None) -> None:
    """Order the contacts by vertex, and set what the impulses need.

    Without ``first``, shape (1,), no contact has an impulse yet; else those before it keep theirs.
    """
    depth.contacts_by_vertex(model, work)
    impulse.begin(model, x0, work, work.none if first is None else first)


def vertex_contacts(model: Model, x0: wp.array, x: wp.array, work: Work, fresh: bool) -> None:
    """Records of the vertices inside other bodies at the positions ``x``."""

    def find() -> None:
        narrow_phase.find_hits(model, x, work)
        wp.capture_if(work.n_hit, make_contacts, work.contacts.n.zero_)

    def make_contacts() -> None:
        depth.hit_depths(model, x, work)
        depth.vertex_contacts(model, x0, x, work, fresh)

    def none() -> None:
        work.n_hit.zero_()
        work.contacts.n.zero_()

    wp.capture_if(work.candidates.verts.n, find, none)


def edge_contacts(
    model: Model, x0: wp.array, x: wp.array, work: Work, fresh: bool, hold: bool = False
) -> None:
    """Records of the edges across other bodies at ``x``, behind those of the vertices.

    ``hold``: those that the step has already stay as they are, with their impulses, and new ones
    are arranged with them.
    """
    look = partial(narrow_phase.find_crossings, model, x0, x, work, fresh, hold)

    def none() -> None:
        work.n_crossing.zero_()
        work.n_new.zero_()

    wp.capture_if(work.candidates.edges.n, look, none)

    def add() -> None:
        depth.edge_contacts(model, x0, work)
        arrange(model, x0, work, work.n_hit)
        impulse.recall_edges(work)

    if hold:
        wp.capture_if(work.n_new, add)
    else:
        wp.capture_if(work.n_crossing, partial(depth.edge_contacts, model, x0, work))


def hold_edges(model: Model, x0: wp.array, work: Work, search: bool) -> None:
    """Let the contacts of edges go on that pressed in the last step; this one begins at ``x0``.

    With ``search`` none does: what is moved apart there is not what the impulses held.
    """

    def hold() -> None:
        narrow_phase.hold_crossings(model, x0, work)
        wp.capture_if(work.n_crossing, partial(depth.edge_contacts, model, x0, work))

    def none() -> None:
        work.place.fill_(-1)
        work.n_place.zero_()

    if search:
        none()
    else:
        wp.capture_if(work.warm.n_held, hold, none)


def move_surfaces(
    model: Model, state: State, work: Work, response: ContactSurface, search: bool
) -> None:
    """Stages 3 and 4: displace the surfaces onto a common one, after ``surface.leftover``.

    No motion comes of it.
    """

    def find_surface() -> None:
        surface.begin_search(model, state.x, work)
        if response.search == "literal":
            surface.bisect(model, state.x, work, response)
        else:
            surface.balance(model, state.x, work, response)

    def close(deep: float) -> None:
        surface.close(model, state.x, state.v, work, deep)

    def resolve() -> None:
        if search:
            wp.capture_if(work.found[1:2], find_surface)
        # What overlapped before the step is the search's. In a step without one, no overlap can be
        # that old: the plane is a wrong one, and the look that follows may find a better one.
        close(surface.DEEP)
        # Where vertices came to lie, their triangles may be others than those of stage 2, and edges
        # may cross that it could not see.
        contacts(model, state.x, state.x, work, not search)
        surface.leftover(model, state.x, work)
        wp.capture_if(work.found[0:1], partial(close, surface.DEEP if search else math.inf))

    wp.capture_if(work.found[0:1], find_surface if response.search == "literal" else resolve)
