"""The points of the chart: their table, and who of them is ahead."""

import csv
from math import inf
from pathlib import Path
from typing import NamedTuple

HEAD = "panel", "method", "setting", "wall s per simulated s", "error", "outcome"
HEAD += "start-up s", "shown"


class Point(NamedTuple):
    """A method at one setting in one panel: an error and what it cost, or why there is none."""

    panel: str
    method: str
    setting: str  # its knobs, as text
    wall: float | None  # seconds per simulated second; None where nothing could be timed
    error: float | None = None  # None where the run has failed
    outcome: str = "ok"  # or the reason why there is no error
    startup: float | None = None  # seconds up to the end of the first frame: build, compile or load
    shown: str = "yes"  # in the pictures and words; of penalties only the best stiffness is


def write(path: Path, points: list[Point]) -> None:
    """All points, with all digits."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([HEAD, *points])


def read(path: Path) -> list[Point]:
    """The points of a table that ``write`` wrote."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = [Point(*row) for row in csv.reader(file)][1:]
    numbers = "wall", "error", "startup"
    return [
        p._replace(**{k: float(n) if (n := getattr(p, k)) else None for k in numbers}) for p in rows
    ]


def cost(p: Point) -> tuple[float, float]:
    """Time and error; a failure is behind everything."""
    return (inf, inf) if p.error is None else (p.wall, p.error)


def dominates(a: Point, b: Point) -> bool:
    """Whether ``a`` is no worse in time and error, and better in one; failures dominate nothing."""
    (time, error), (other_time, other_error) = cost(a), cost(b)
    return time <= other_time and error <= other_error and cost(a) != cost(b)


def front(points: list[Point]) -> list[Point]:
    """The points that none dominates, the fastest first; failures are never among them."""
    fine = [p for p in points if p.error is not None]
    return sorted((p for p in fine if not any(dominates(q, p) for q in fine)), key=cost)


def fastest_below(points: list[Point], error: float) -> Point | None:
    """The quickest point with at most this error."""
    return min((p for p in points if cost(p)[1] <= error), key=cost, default=None)
