"""``metrics.jsonl``: a line a frame, with every figure of ``Simulation.measure()``.

Each line stands in the file of its frame too: from there ``--resume`` writes the file anew.
"""

import json
import math
from dataclasses import fields

import numpy as np

from warp_contact import Measure


def figures(measured: Measure) -> dict:
    """All fields and properties of a measurement by their names, as JSON takes them."""
    names = [field.name for field in fields(measured)]
    kind = type(measured)
    names += [name for name in dir(kind) if isinstance(getattr(kind, name), property)]
    return {name: plain(getattr(measured, name)) for name in names}


def plain(value):
    """A value as JSON takes it.

    Null stands for a number that is not finite; what belongs to a pair (a, b) is found by a, then
    by b.
    """
    if isinstance(value, dict):
        pairs: dict = {}
        for (a, b), item in value.items():
            pairs.setdefault(a, {})[b] = plain(item)
        return pairs
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def line_of(sim, measured: Measure) -> str:
    """The line of a frame."""
    values = {"frame": sim.frame, "time": sim.time, **figures(measured)}
    return json.dumps(values, allow_nan=False) + "\n"
