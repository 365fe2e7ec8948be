"""Compile kernels ahead, several modules at a time; otherwise each compiles on its first use."""

import warp as wp

from warp_contact.data.model import Model
from warp_contact.kernels import scan, worlds
from warp_contact.kernels.broad_phase import bounds, edges, hashing, near, pairs, skins
from warp_contact.kernels.elastic import shape
from warp_contact.kernels.implicit import advance, bodies, masses, mobility, predict, settle
from warp_contact.kernels.implicit import solve as iterations
from warp_contact.kernels.impulse import (
    constraint,
    coupled,
    impulse,
    pair_impulses,
    rebound,
    rows,
    strike,
    touched,
    warm_start,
)
from warp_contact.kernels.motion import lanczos, motion
from warp_contact.kernels.narrow_phase import (
    contact_graph,
    depth,
    persistent,
    vertex_contact,
    vertices,
)
from warp_contact.kernels.narrow_phase import edges as crossing
from warp_contact.kernels.surface import closure, coupled_closure, coupled_spin, residual
from warp_contact.kernels.ties import attachment, drive, lacking, matrix, motor, solve
from warp_contact.kernels.ties import closure as tied_closure
from warp_contact.kernels.ties import rows as tied_rows

# What a frame of any scene uses. The search for overlaps at the start, other responses, sleeping
# and measuring are left out: many scenes do not need them.
ALWAYS = [scan, worlds, bounds, edges, hashing, skins, near, pairs, shape, lanczos, motion, closure]
ALWAYS += [constraint, impulse, pair_impulses, warm_start, residual]
ALWAYS += [contact_graph, crossing, depth, persistent, vertex_contact, vertices]
TIES = attachment, tied_closure, drive, lacking, matrix, motor, solve, tied_rows
IMPLICIT = [advance, bodies, masses, mobility, predict, settle, iterations]
IMPLICIT += [coupled, coupled_closure, coupled_spin, rows, touched]


def load_kernels(model: Model, device: wp.Device, implicit: bool) -> None:
    """Load what a frame uses on ``device``; where the cache of Warp lacks it, compile it first.

    Those of ``implicit`` steps too, where they may be taken.
    """
    modules = {*ALWAYS, *(IMPLICIT if implicit else ()), *(e.kernels for e in model.elements)}
    modules |= {*(TIES if model.ties else ())}
    modules |= {*((rebound, strike) if model.restitution.numpy().any() else ())}
    names = sorted(module.__name__ for module in modules)
    wp.force_load(device, [wp.get_module(name) for name in names])
