"""The points of the chart: their table, and who of them is ahead."""

import csv
from dataclasses import dataclass
from pathlib import Path

OK = "ok"
HEAD = "panel", "method", "setting", "wall s per simulated s", "error", "outcome"
HEAD += "start-up s", "shown"


@dataclass(frozen=True)
class Point:
    """A method at one setting in one panel: an error and what it cost, or why there is none.

    Attributes:
        panel: name of the panel
        method: name of the method
        setting: its knobs, as text
        wall: seconds per simulated second; None where nothing could be timed
        error: None where the run has none
        outcome: ``ok``, or the reason why there is no error
        startup: seconds up to the end of the first frame: build, compile or load
        shown: whether the pictures have it; of penalties only the best stiffness is
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

    def cells(self) -> list[str]:
        """A row of the table, with all digits."""
        numbers = ("" if n is None else str(n) for n in (self.wall, self.error, self.startup))
        wall, error, startup = numbers
        row = [self.panel, self.method, self.setting, wall, error, self.outcome, startup]
        return [*row, "yes" if self.shown else "no"]


def write(path: Path, points: list[Point]) -> None:
    """All points."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([HEAD, *(point.cells() for point in points)])


def read(path: Path) -> list[Point]:
    """The points of a table that ``write`` wrote."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    found = []
    for *names, wall, error, outcome, startup, shown in rows:
        wall, error, startup = (float(n) if n else None for n in (wall, error, startup))
        found.append(Point(*names, wall, error, outcome, startup, shown == "yes"))
    return found


def dominates(a: Point, b: Point) -> bool:
    """Whether ``a`` is no worse in time and error, and better in one; failures dominate nothing."""
    if a.failed or b.failed:
        return not a.failed
    no_worse = a.wall <= b.wall and a.error <= b.error
    return no_worse and (a.wall < b.wall or a.error < b.error)


def front(points: list[Point]) -> list[Point]:
    """The points that none dominates, the fastest first; failures are never among them."""
    kept = [p for p in points if not p.failed and not any(dominates(q, p) for q in points)]
    return sorted(kept, key=lambda p: p.wall)


def fastest_below(points: list[Point], error: float) -> Point | None:
    """The quickest point with at most this error."""
    fine = [p for p in points if not p.failed and p.error <= error]
    return min(fine, key=lambda p: p.wall, default=None)
