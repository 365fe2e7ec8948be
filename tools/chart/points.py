"""The points of the chart: their table, and who of them is ahead."""

import csv
from dataclasses import astuple, dataclass
from pathlib import Path

OK = "ok"
HEAD = "panel", "method", "setting", "wall s per simulated s", "error", "outcome"
HEAD += "start-up s", "shown"


@dataclass(frozen=True)
class Point:
    """A method at one setting in one panel: an error and what it cost, or why there is none.

    A type of its own beside ``measure.figure.Figure``, which has no cost: points are ahead of each
    other in both, and none is judged by a limit.
    """

    panel: str
    method: str
    setting: str  # its knobs, as text
    wall: float | None  # seconds per simulated second; None where nothing could be timed
    error: float | None  # None where the run has none
    outcome: str = OK  # or the reason why there is no error
    startup: float | None = None  # seconds up to the end of the first frame: build, compile or load
    shown: bool = True  # in the pictures; of penalties only the best stiffness is

    @property
    def failed(self) -> bool:
        """Whether it belongs on the rail."""
        return self.outcome != OK

    def cells(self) -> list[str]:
        """A row of the table, with all digits."""
        *cells, shown = astuple(self)
        return [*("" if c is None else str(c) for c in cells), "yes" if shown else "no"]


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
