"""Scratch of the search for the contact surface and of the closure."""

from dataclasses import dataclass

import warp as wp

from warp_contact.kernels.surface.residual import OLD, OPEN, WORLDS


@dataclass
class Surface:
    """Residual overlaps after the impulses, and the search for the common surface.

    Attributes:
        found: the five below, shape (2 + 3 n_world,)
        of_looks: all of them but ``was_old``: those of a step, shape (2 + 2 n_world,)
        of_look: the next two, which are those of a look, shape (2,)
        any_open: whether some overlap is to be closed, shape (1,)
        any_old: whether some is for the search, being older than the step, shape (1,)
        open: the last look that found an overlap to be closed, of each world, shape (n_world,)
        old: whether some is for the search, in each world, shape (n_world,)
        was_old: whether there was any for the search since the frame began, shape (n_world,)
        residual: residual overlap, 0 up to a tolerance [m], shape (contacts,)
        slack: part of it that later steps close [m], shape (contacts,)
        push: of the closure [kg m], shape (contacts,)
        mask: tets that touch the region, shape (n_tet,)
        s: displacement vectors of eq. (1) [m], shape (n_vert,)
        area: areas of comparison [m^2], shape (n_vert,)
        at_start, at_trial: tractions before the search and at a trial [Pa], shape (n_vert,)
        stiffness: traction gained over the whole of s [Pa], shape (n_vert,)
        fraction: the part of s that a vertex moves, shape (n_vert,)
        upper_mean, lower_mean: of traction, stiffness, fraction at both sides of each contact,
            shape (contacts,)
        centre, spin: centre of mass [m] and rotation [1/s] that each body gets, shape (n_body,)
    """

    found: wp.array[int]
    of_looks: wp.array[int]
    of_look: wp.array[int]
    any_open: wp.array[int]
    any_old: wp.array[int]
    open: wp.array[int]
    old: wp.array[int]
    was_old: wp.array[int]
    residual: wp.array[float]
    slack: wp.array[float]
    push: wp.array[float]
    mask: wp.array[int]
    s: wp.array[wp.vec3]
    area: wp.array[float]
    at_start: wp.array[float]
    at_trial: wp.array[float]
    stiffness: wp.array[float]
    fraction: wp.array[float]
    upper_mean: wp.array[wp.vec3]
    lower_mean: wp.array[wp.vec3]
    centre: wp.array[wp.vec3]
    spin: wp.array[wp.vec3]


def allocate(n_world: int, n_body: int, n_vert: int, n_tet: int, n_contact: int) -> Surface:
    """Allocate without any overlap."""
    found = wp.zeros(int(WORLDS) + 3 * n_world, dtype=int)
    of_worlds = found[int(WORLDS) :]
    return Surface(
        found=found,
        of_looks=found[: int(WORLDS) + 2 * n_world],
        of_look=found[: int(WORLDS)],
        any_open=found[int(OPEN) : int(OPEN) + 1],
        any_old=found[int(OLD) : int(OLD) + 1],
        open=of_worlds[:n_world],
        old=of_worlds[n_world : 2 * n_world],
        was_old=of_worlds[2 * n_world :],
        residual=wp.zeros(n_contact, dtype=float),
        slack=wp.zeros(n_contact, dtype=float),
        push=wp.zeros(n_contact, dtype=float),
        mask=wp.zeros(n_tet, dtype=int),
        s=wp.zeros(n_vert, dtype=wp.vec3),
        area=wp.zeros(n_vert, dtype=float),
        at_start=wp.zeros(n_vert, dtype=float),
        at_trial=wp.zeros(n_vert, dtype=float),
        stiffness=wp.zeros(n_vert, dtype=float),
        fraction=wp.zeros(n_vert, dtype=float),
        upper_mean=wp.zeros(n_contact, dtype=wp.vec3),
        lower_mean=wp.zeros(n_contact, dtype=wp.vec3),
        centre=wp.zeros(n_body, dtype=wp.vec3),
        spin=wp.zeros(n_body, dtype=wp.vec3),
    )
