"""A figure of the table: a measured value, its reference, its error, the level it reaches."""

from dataclasses import dataclass

import numpy as np

LEVELS = "best", "excellent", "good"  # from the strictest to the widest limit
MISSED = "-"
COLUMNS = "case", "figure", "value", "reference", "error", "level"
WIDTHS = 40, 44, 11, 11, 10, 9  # [characters]


@dataclass(frozen=True)
class Figure:
    """One figure.

    Attributes:
        case: what was run
        name: what was measured, with its unit
        value: as measured
        reference: exact value, None where there is none but an ideal of zero
        error: what the limits are for
        limits: largest errors that are good, excellent and best; empty for a figure that is
            shown only
    """

    case: str
    name: str
    value: float
    reference: float | None = None
    error: float | None = None
    limits: tuple[float, ...] = ()

    @property
    def level(self) -> str:
        """The strictest level whose limit holds; an error that is not a number reaches none."""
        if not self.limits:
            return ""
        held = (n for n, most in zip(LEVELS, reversed(self.limits), strict=True) if self.ok(most))
        return next(held, MISSED)

    def ok(self, most: float) -> bool:
        """Whether the size of the error is at most ``most``."""
        return self.error is not None and bool(abs(self.error) <= most)

    @property
    def cells(self) -> tuple[str, ...]:
        """The columns of the table as text."""
        numbers = (self.value, self.reference, self.error)
        shown = ("" if x is None else f"{x:.4g}" for x in numbers)
        return self.case, self.name, *shown, self.level

    def __str__(self):
        """One line of the table."""
        return "  ".join(c.ljust(w) for c, w in zip(self.cells, WIDTHS, strict=True)).rstrip()


def head() -> str:
    """The names of the columns."""
    line = "  ".join(c.ljust(w) for c, w in zip(COLUMNS, WIDTHS, strict=True))
    return f"{line}\n{'-' * len(line)}"


def lowest(figures) -> str:
    """The level that all figures with limits hold; empty when none has any."""
    order = *LEVELS, MISSED
    ranks = [order.index(f.level) for f in figures if f.limits]
    return order[max(ranks)] if ranks else ""


def relative(case: str, name: str, value: float, exact: float, limits=()) -> Figure:
    """A figure whose error is value / exact - 1."""
    return Figure(case, name, float(value), exact, float(value / exact - 1.0), limits)


def zero(case: str, name: str, value: float, limits=()) -> Figure:
    """A figure that ought to vanish."""
    return Figure(case, name, float(value), 0.0, float(value), limits)


def rms(values) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
