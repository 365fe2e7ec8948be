"""One figure: a measured value, what it ought to be, and how well it holds.

A figure is judged in one of two ways, or only shown:

    limits         largest sizes of its error, the widest first: it reaches the level whose limit
                   holds, one limit being ``ok``, two or three ``good``, ``excellent``, ``best``
    least, most    bounds of its value: ``ok`` within

What holds nothing is ``missed``.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

OK, BEST, EXCELLENT, GOOD, MISSED = "ok", "best", "excellent", "good", "missed"
ORDER = OK, BEST, EXCELLENT, GOOD, MISSED  # each is worse than those before it
LEVELS = GOOD, EXCELLENT, BEST  # of two or three limits


class Figure(NamedTuple):
    """One figure."""

    case: str  # what was run
    name: str  # what was measured, with its unit
    value: float | None  # None where nothing could be measured
    reference: float | None = None  # exact value, or the one to compare with
    error: float | None = None  # what the limits are for
    limits: tuple[float, ...] = ()
    least: float | None = None
    most: float | None = None
    note: str = ""  # what there is to say beyond the number

    @property
    def level(self) -> str:
        """What it reaches, one of ``ORDER``; empty for a figure that is shown only."""
        if self.limits:
            held = sum(self.error is not None and abs(self.error) <= most for most in self.limits)
            return (MISSED, *(LEVELS if len(self.limits) > 1 else (OK,)))[held]
        if self.least is None and self.most is None:
            return ""
        value = np.nan if self.value is None else self.value
        low = self.least is None or value >= self.least
        return OK if low and (self.most is None or value <= self.most) else MISSED


Figures = Iterator[Figure]


def relative(case: str, name: str, value: float, exact: float, limits=()) -> Figure:
    """A figure whose error is value / exact - 1."""
    return Figure(case, name, float(value), exact, float(value / exact - 1.0), limits)


def zero(case: str, name: str, value: float, limits=()) -> Figure:
    """A figure that ought to vanish."""
    return Figure(case, name, float(value), 0.0, float(value), limits)


def lowest(figures: Iterable[Figure]) -> str:
    """What all judged figures hold; empty where none is judged."""
    return max((f.level for f in figures if f.level), key=ORDER.index, default="")


def rms(values) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
