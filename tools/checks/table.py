"""A row of the table and how it prints."""

from dataclasses import dataclass

WIDTHS = 46, 50, 11, 10  # of the columns [characters]


@dataclass(frozen=True)
class Row:
    """One figure.

    Attributes:
        case: what was run
        figure: what was measured, with its unit
        value: as measured
        most: largest value that is fine, None for a figure without a target
        least: smallest value that is fine
    """

    case: str
    figure: str
    value: float
    most: float | None = None
    least: float | None = None

    @property
    def ok(self) -> bool:
        """Whether the value meets its targets; one that is not a number does not."""
        above = self.most is not None and not self.value <= self.most
        below = self.least is not None and not self.value >= self.least
        return not (above or below)

    @property
    def target(self) -> str:
        """The targets in words."""
        parts = [f"<= {self.most:.4g}"] if self.most is not None else []
        parts += [f">= {self.least:.4g}"] if self.least is not None else []
        return " ".join(parts)

    def __str__(self):
        """One line of the table."""
        verdict = "" if not self.target else "ok" if self.ok else "MISS"
        cells = self.case, self.figure, f"{self.value:.4g}", self.target
        return "  ".join(c.ljust(w) for c, w in zip(cells, WIDTHS, strict=True)) + f"  {verdict}"


def head() -> str:
    """The names of the columns."""
    cells = "case", "figure", "value", "target"
    line = "  ".join(c.ljust(w) for c, w in zip(cells, WIDTHS, strict=True))
    return f"{line}\n{'-' * (len(line) + 6)}"
