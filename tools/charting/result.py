"""One point of the chart, and the table of all of them."""

import csv
from dataclasses import dataclass, fields
from pathlib import Path

OK = "ok"


@dataclass(frozen=True)
class Point:
    """A method at one setting in one panel.

    Attributes:
        panel: name of the panel
        method: name of the method
        setting: its knobs, as text
        wall: seconds per simulated second; None where nothing could be timed
        error: None where the run has none
        outcome: ``ok``, or the reason why there is no error
        startup: seconds up to the end of the first frame: build, compile or load
        shown: whether the picture has it; of penalties only the best stiffness is
    """

    panel: str
    method: str
    setting: str
    wall: float | None
    error: float | None
    outcome: str = OK
    startup: float | None = None
    shown: bool = True

    @property
    def failed(self) -> bool:
        """Whether it belongs on the rail."""
        return self.outcome != OK


HEAD = (
    "panel",
    "method",
    "setting",
    "wall s per simulated s",
    "error",
    "outcome",
    "start-up s",
    "shown",
)


def write(path: Path, points: list[Point]) -> None:
    """All points with all digits."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(HEAD)
        out.writerows(cells(point) for point in points)


def cells(point: Point) -> list[str]:
    """A row of the table."""
    return [_cell(getattr(point, field.name)) for field in fields(Point)]


def read(path: Path) -> list[Point]:
    """The points of a table that ``write`` wrote."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    return [
        Point(*row[:3], _number(row[3]), _number(row[4]), row[5], _number(row[6]), row[7] == "yes")
        for row in rows
    ]


def _cell(value) -> str:
    if value is None:
        return ""
    return ("no", "yes")[value] if isinstance(value, bool) else str(value)


def _number(cell: str) -> float | None:
    return float(cell) if cell else None
