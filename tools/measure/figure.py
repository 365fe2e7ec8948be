"""One figure: a measured value, what it ought to be, and how well it holds.

A figure is judged in one of two ways, or only shown:

    limits         largest sizes of its error, the widest first: it reaches the level whose limit
                   holds, one limit being ``ok``, two or three ``good``, ``excellent``, ``best``
    least, most    bounds of its value: ``ok`` within

What holds nothing is ``missed``.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

OK, BEST, EXCELLENT, GOOD, MISSED = "ok", "best", "excellent", "good", "missed"
ORDER = OK, BEST, EXCELLENT, GOOD, MISSED  # each is worse than those before it
LEVELS = GOOD, EXCELLENT, BEST  # of two or three limits


@dataclass(frozen=True)
class Figure:
    """One figure.

    Attributes:
        case: what was run
        name: what was measured, with its unit
        value: as measured, None where nothing could be
        reference: exact value, or the one to compare with
        error: what the limits are for
        limits: largest sizes of the error, from the widest to the strictest
        least, most: bounds of the value
        note: what there is to say beyond the number
    """

    case: str
    name: str
    value: float | None
    reference: float | None = None
    error: float | None = None
    limits: tuple[float, ...] = ()
    least: float | None = None
    most: float | None = None
    note: str = ""

    @property
    def judged(self) -> bool:
        """Whether anything is wanted of it."""
        return bool(self.limits) or self.least is not None or self.most is not None

    @property
    def level(self) -> str:
        """What it reaches, one of ``ORDER``; empty for a figure that is shown only."""
        if not self.judged:
            return ""
        if not self.limits:
            low = -math.inf if self.least is None else self.least
            high = math.inf if self.most is None else self.most
            return OK if self.value is not None and low <= self.value <= high else MISSED
        held = sum(self.error is not None and abs(self.error) <= most for most in self.limits)
        return (MISSED, *(LEVELS if len(self.limits) > 1 else (OK,)))[held]


Figures = Iterator[Figure]


def relative(case: str, name: str, value: float, exact: float, limits=()) -> Figure:
    """A figure whose error is value / exact - 1."""
    return Figure(case, name, float(value), exact, float(value / exact - 1.0), limits)


def zero(case: str, name: str, value: float, limits=()) -> Figure:
    """A figure that ought to vanish."""
    return Figure(case, name, float(value), 0.0, float(value), limits)


def lowest(figures: Iterable[Figure]) -> str:
    """What all judged figures hold; empty where none is judged."""
    return max((f.level for f in figures if f.judged), key=ORDER.index, default="")


def rms(values) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
