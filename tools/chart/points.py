"""The points of the chart: their table, who of them is ahead, and that in words."""

import csv
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

HEAD = "panel", "method", "setting", "CPU s per simulated s", "error", "outcome", "start-up s"
BY_ERROR = attrgetter("error")


class Point(NamedTuple):
    """A method at one setting in one panel: an error and what it cost, or why there is none."""

    panel: str
    method: str
    setting: str  # its knobs, as text
    cpu: float | None  # seconds per simulated second; None where nothing could be timed
    error: float | None = None  # None where the run has failed
    outcome: str = "ok"  # or the reason why there is no error
    startup: float | None = None  # CPU s up to the end of the first frame: build, compile or load


def write(path: Path, points: list[Point]) -> None:
    """All points, with all digits."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([HEAD, *points])


def read(path: Path) -> list[Point]:
    """The points of a table that ``write`` wrote."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    found = []
    for *names, cpu, error, outcome, startup in rows:
        cpu, error, startup = (float(n) if n else None for n in (cpu, error, startup))
        found.append(Point(*names, cpu, error, outcome, startup))
    return found


def dominates(a: Point, b: Point) -> bool:
    """Whether ``a`` is no worse in time and error, and better in one; failures dominate nothing."""
    if a.error is None or b.error is None:
        return a.error is not None
    return a.cpu <= b.cpu and a.error <= b.error and (a.cpu, a.error) != (b.cpu, b.error)


def front(points: list[Point]) -> list[Point]:
    """The points that none dominates, the fastest first; failures are never among them."""
    fine = [p for p in points if p.error is not None]
    return sorted(
        (p for p in fine if not any(dominates(q, p) for q in fine)), key=attrgetter("cpu")
    )


def report(head: str, titles: dict[str, str], points: list[Point]) -> str:
    """All panels, after ``head``: machine, versions, date."""
    parts = [head]
    for name, title in titles.items():
        mine = [p for p in points if p.panel == name]
        parts.append("\n".join([title.replace("\n", ": "), *panel(mine)]))
    return "\n\n".join(parts) + "\n"


def panel(points: list[Point]) -> list[str]:
    """Who is on the front, behind it, before the default; failures."""
    of = {p.method: [q for q in points if q.method == p.method] for p in points}
    ahead = front(points)
    lines = [f"  front: {_show(p)}" for p in ahead] or ["  front: empty, every run failed"]
    for method, mine in of.items():
        fine = [p for p in mine if p.error is not None]
        if fine and method not in {p.method for p in ahead}:
            lines.append(f"  behind the front: {_show(min(fine, key=BY_ERROR))} is its best")
    own = front(of.get("default", []))
    if own:
        before = [m for m in of if any(dominates(p, q) for p in of[m] for q in own)]
        said = ", ".join(before) or "none"
        lines.append(f"  faster and no less accurate than a point of the default's front: {said}")
    for method, mine in of.items():
        why = [p.outcome for p in mine if p.error is None]
        if why:
            said = "; ".join(dict.fromkeys(why))
            lines.append(f"  failed: {method}, {len(why)} of {len(mine)}: {said}")
    return lines


def _show(p: Point) -> str:
    return f"{p.method} ({p.setting}), {p.cpu:.3g} s per s, error {p.error:.2g}"
