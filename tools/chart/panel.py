"""What a panel of the chart shows of a run."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from engines.task import Failed, Motion, Numbered, Task

from chart.laws import Elastic

TUNNELLED = 1.0  # of an edge: an overlap from which a body is on the wrong side
INVERTED = 0.0  # volume ratio at the end
LAST = 0.1  # part of the frames at the end over which a state of rest is averaged


class Panel(NamedTuple):
    """An error of the runs of a task."""

    name: str  # short, as in the table
    title: str  # of the panel, and on a second line what the error is
    error: Callable[[Task, Motion], float]  # of a motion; raises ``Failed``


def sound(task: Task, motion: Motion) -> tuple[Numbered, Elastic]:
    """The bodies and their law; ``Failed`` for a motion that ends with inverted tets or no numbers.

    An engine is judged by the law of elasticity that it simulates.
    """
    if not np.isfinite(motion.x).all():
        raise Failed("not finite")
    whole = Numbered(task.scene())
    solid = Elastic(whole.rest, whole.tets, whole.lame, motion.law)
    ratio = solid.least_volume(motion.x[-1])
    if ratio <= INVERTED:
        raise Failed(f"tets left inverted (volume ratio {ratio:.2g})")
    return whole, solid


def late(task: Task, part: float = LAST) -> slice:
    """The frames at the end, two at least."""
    return slice(-max(2, round(part * task.frames)), None)
