"""Kernels compiled ahead, several modules at a time; each compiles on its first use otherwise."""

import warp as wp

from warp_contact.kernels import (
    bounds,
    candidates,
    closure,
    crossing,
    hashing,
    held,
    hits,
    impulse,
    incidence,
    lanczos,
    motion,
    near,
    pair_impulses,
    pairs,
    penetration,
    shape,
    vertex_contact,
    warm,
)
from warp_contact.types import Model

# What a frame of any scene uses. The search for overlaps at the start, other responses, sleep and
# measuring are left out: many scenes do without.
ALWAYS = (bounds, candidates, closure, crossing, hashing, held, hits, impulse, incidence)
ALWAYS += (lanczos, motion, near, pair_impulses, pairs, penetration, shape, vertex_contact, warm)


def load_kernels(model: Model, device: wp.Device) -> None:
    """Load what a frame uses on ``device``; where the cache of Warp lacks it, compile it first."""
    modules = {*ALWAYS, *(e.kernels for e in model.elements)}
    names = sorted(module.__name__ for module in modules)
    wp.force_load(device, [wp.get_module(name) for name in names])
