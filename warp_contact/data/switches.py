"""Parts of the method that can be switched off, to see what each of them is for.

A switch is read when the steps of a frame are captured, so it costs nothing in them. No option of
the package sets one: an ablation study makes its simulations within ``without(name)``.
"""

from collections.abc import Iterator
from contextlib import contextmanager

PARTS = (
    "broad phase kept",  # pairs that may touch are kept for many steps
    "edges",  # contacts of edges
    "layers",  # depth of penetrations behind the border
    "warm start",  # impulses start from those of the last step
    "persistent edges",  # contacts of edges persist from step to step
    "extrapolation",  # sweeps run from extrapolated impulses
    "search",  # for the surface between bodies whose overlap is older than the step
    "closure",  # projection of overlaps onto the planes of triangles
    "old planes",  # the first closure leaves out contacts that seem older than the step
    "second look",  # a detection pass after the closure
    "strays",  # vertices that left their triangle are closed as well
    "closure torque",  # handed back to the velocities
    "search spin",  # bodies keep the angular momentum that the search would change
)
_off: set[str] = set()


def on(part: str) -> bool:
    """Whether a part is in use; raises KeyError where there is no such part."""
    if part not in PARTS:
        raise KeyError(part)
    return part not in _off


@contextmanager
def without(part: str) -> Iterator[None]:
    """Switch a part off for the simulations whose steps are captured within."""
    if not on(part):
        raise ValueError(f"'{part}' is off already")
    _off.add(part)
    try:
        yield
    finally:
        _off.remove(part)
