"""The chart in words, computed from its table."""

from charting.front import dominates, front
from charting.front import fastest_below as fastest
from charting.result import Point

DEFAULT = "default"
LEVELS = 0.05, 0.01, 0.001  # errors at which times are compared
TIMES = 1.0, 10.0  # wall seconds per simulated second at which errors are compared


def report(head: str, titles: dict[str, str], points: list[Point]) -> str:
    """All panels, after ``head``: machine, versions, date."""
    parts = [head]
    for name, title in titles.items():
        mine = [p for p in points if p.panel == name and p.shown]
        if mine:
            parts.append("\n".join([title.replace("\n", ": "), *panel(mine)]))
    return "\n\n".join(parts) + "\n"


def panel(points: list[Point]) -> list[str]:
    """Who is on the front, behind it, before the default; times at equal error; failures."""
    methods = list(dict.fromkeys(p.method for p in points))
    ahead = front(points)
    lines = [f"  front: {_show(p)}" for p in ahead] or ["  front: empty, every run failed"]
    on = dict.fromkeys(p.method for p in ahead)
    for method in methods:
        mine = [p for p in points if p.method == method]
        fine = [p for p in mine if not p.failed]
        if fine and method not in on:
            best = min(fine, key=lambda p: p.error)
            lines.append(f"  behind the front: {_show(best)} is its best")
    own = front(_of(points, DEFAULT))
    before = [m for m in methods if any(dominates(p, q) for p in _of(points, m) for q in own)]
    if own:
        said = ", ".join(before) or "none"
        lines.append(f"  faster and no less accurate than a point of the default's front: {said}")
    for level in LEVELS:
        first = sorted(filter(None, (fastest(_of(points, m), level) for m in methods)), key=_wall)
        said = ", ".join(f"{p.method} {p.wall:.3g} s" for p in first) or "none"
        lines.append(f"  error at most {level:g}: {said}")
    for time in TIMES:
        within = [[p for p in _of(points, m) if not p.failed and p.wall <= time] for m in methods]
        first = sorted((min(w, key=_error) for w in within if w), key=_error)
        said = ", ".join(f"{p.method} {p.error:.2g}" for p in first) or "none"
        lines.append(f"  within {time:g} s per s: {said}")
    for method in methods:
        failed = [p for p in _of(points, method) if p.failed]
        if failed:
            why = "; ".join(dict.fromkeys(p.outcome for p in failed))
            lines.append(f"  failed: {method}, {len(failed)} of {len(_of(points, method))}: {why}")
    return lines


def _of(points: list[Point], method: str) -> list[Point]:
    return [p for p in points if p.method == method]


def _show(p: Point) -> str:
    return f"{p.method} ({p.setting}), {p.wall:.3g} s per s, error {p.error:.2g}"


def _wall(p: Point) -> float:
    return p.wall


def _error(p: Point) -> float:
    return p.error
