"""How a part of the package is switched off, from outside."""

import math
from collections.abc import Callable
from contextlib import contextmanager
from types import ModuleType
from unittest import mock

import warp as wp

from warp_contact.frame import step_bounds
from warp_contact.kernels.impulse import impulse as impulse_kernels
from warp_contact.step import broad_phase, depth, forces, impulse, step, surface


def without(owner, attribute: str, new) -> Callable:
    """A context maker that puts ``new`` in the place of a function or constant of the package."""
    getattr(owner, attribute)
    return lambda: mock.patch.object(owner, attribute, new)


def constant(owner: ModuleType, name: str, value, *users: ModuleType) -> Callable:
    """A context maker that compiles kernels with another constant of ``owner``.

    Those of ``owner``, and of ``users``: modules whose kernels call functions of it.
    """
    getattr(owner, name)

    @contextmanager
    def compiled():
        modules = [wp.get_module(module.__name__) for module in {owner, *users}]
        try:
            with mock.patch.object(owner, name, wp.constant(value)):
                for module in modules:
                    module.mark_modified()
                yield
        finally:
            for module in modules:
                module.mark_modified()

    return compiled


def without_repeats():
    """A context in which the stable step of the start of a frame is that of its end too."""
    return mock.patch.object(step_bounds, "UNSTABLE", math.inf)


def nothing(*args) -> None:
    """In the place of a stage."""


def no_crossings(model, x0, x, work, fresh, hold=False) -> None:
    """In the place of ``solver.edge_contacts``."""
    work.n_crossing.zero_()


def by_mass(model, state, work, response, search, move=step.move_surfaces) -> None:
    """In the place of ``solver.move_surfaces``: deep overlaps are left to the closure too."""
    move(model, state, work, response, False)


def blind(model, state, work, response, search, move=step.move_surfaces) -> None:
    """In the place of ``solver.move_surfaces``: what the closure moved is not looked at."""
    with mock.patch.object(step, "contacts", nothing):
        move(model, state, work, response, search)


def unseen(model, state, work, response, search, move=step.move_surfaces) -> None:
    """In the place of ``solver.move_surfaces``: after the closure it looks at edges alone."""
    with mock.patch.object(step, "vertex_contacts", nothing):
        move(model, state, work, response, search)


def border_only(model, x, work, find=depth.hit_depths) -> None:
    """In the place of ``depth.hit_depths``: no layer behind the border."""
    with mock.patch.object(wp, "capture_while", nothing):
        find(model, x, work)


def without_couple(model, x, v, work, search, close=surface.close) -> None:
    """In the place of ``surface.close``: what it hands back to ``v`` goes to a scratch array."""
    close(model, x, work.v, work, search)


def none_held(model, x0, work, search) -> None:
    """In the place of ``solver.hold_edges``: contacts of edges are found in every step anew."""
    work.place.fill_(-1)
    work.n_place.zero_()


def no_strays(model, x, work, strays=False, more=False, leftover=surface.leftover) -> None:
    """In the place of ``surface.leftover``: nobody asks who left a triangle."""
    leftover(model, x, work, more=more)


def rubbing(model, x0, work, first, begin=impulse.begin) -> None:
    """In the place of ``impulse.begin``: friction across gaps of any width."""
    begin(model, x0, work, first)
    work.contacts.mu.fill_(model.friction)


def straight(model, x0, work, first, begin=impulse.begin) -> None:
    """In the place of ``impulse.begin``: friction acts across gaps as if they were closed."""
    begin(model, x0, work, first)
    work.contacts.open.zero_()


def level(model, x0, work, first, begin=impulse.begin) -> None:
    """In the place of ``impulse.begin``: no facet leans, and no couple comes of it."""
    begin(model, x0, work, first)
    work.contacts.ramp.zero_()
    if model.friction == 0.0:
        wp.copy(work.contacts.coupled, work.contacts.weight)


def all_planes(model, x, v, work, deep, close=surface.close) -> None:
    """In the place of ``surface.close``: planes behind which a vertex was are used as well."""
    close(model, x, v, work, math.inf)


def uncoupled(model, x0, work, first, begin=impulse.begin) -> None:
    """In the place of ``impulse.begin``: the sweeps do not count on what the couple moves."""
    begin(model, x0, work, first)
    wp.copy(work.contacts.coupled, work.contacts.weight)


def plain(kernel, *args, launch=wp.launch, **kwargs) -> None:
    """In the place of ``wp.launch``: every sweep of the impulses is a plain one, like the last."""
    if kernel is impulse_kernels.solve_contacts:
        kwargs["inputs"] = [*kwargs["inputs"][:-1], True]
    launch(kernel, *args, **kwargs)


def damp_last(model, state, work, stages) -> None:
    """In the place of ``solver.predict``: the forces first."""
    step.kick(model, state, work)
    if stages > 0:
        scratch = work.v, work.s
        given = work.dt, work.f_tet, scratch, stages, work.share
        forces.damp(model, state.x, state.v, model.inv_mass, *given)
    step.drift(model, state, work, work.x)


def found_anew(model, x0, x1, work, refresh=broad_phase.refresh) -> None:
    """In the place of ``candidates.refresh``: all that was found is out of date."""
    work.candidates.x.fill_(wp.vec3(math.inf))
    refresh(model, x0, x1, work)
