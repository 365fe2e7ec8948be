"""The chart in words, computed from its table."""

from operator import attrgetter

from chart.points import Point, dominates, fastest_below, front

LEVELS = 0.05, 0.01, 0.001  # errors at which times are compared
TIMES = 1.0, 10.0  # wall seconds per simulated second at which errors are compared
BY_ERROR, BY_WALL = attrgetter("error"), attrgetter("wall")


def report(head: str, titles: dict[str, str], points: list[Point]) -> str:
    """All panels, after ``head``: machine, versions, date."""
    parts = [head]
    for name, title in titles.items():
        mine = [p for p in points if p.panel == name and p.shown == "yes"]
        parts.append("\n".join([title.replace("\n", ": "), *panel(mine)]))
    return "\n\n".join(parts) + "\n"


def panel(points: list[Point]) -> list[str]:
    """Who is on the front, behind it, before the default; times at equal error; failures."""
    of = {p.method: [q for q in points if q.method == p.method] for p in points}
    fine = {method: [p for p in mine if p.error is not None] for method, mine in of.items()}
    ahead = front(points)
    lines = [f"  front: {_show(p)}" for p in ahead] or ["  front: empty, every run failed"]
    for method, mine in fine.items():
        if mine and method not in {p.method for p in ahead}:
            lines.append(f"  behind the front: {_show(min(mine, key=BY_ERROR))} is its best")
    own = front(of.get("default", []))
    if own:
        before = [m for m in of if any(dominates(p, q) for p in of[m] for q in own)]
        said = ", ".join(before) or "none"
        lines.append(f"  faster and no less accurate than a point of the default's front: {said}")
    for level in LEVELS:
        first = sorted(filter(None, (fastest_below(of[m], level) for m in of)), key=BY_WALL)
        said = ", ".join(f"{p.method} {p.wall:.3g} s" for p in first) or "none"
        lines.append(f"  error at most {level:g}: {said}")
    for time in TIMES:
        within = [[p for p in mine if p.wall <= time] for mine in fine.values()]
        first = sorted((min(w, key=BY_ERROR) for w in within if w), key=BY_ERROR)
        said = ", ".join(f"{p.method} {p.error:.2g}" for p in first) or "none"
        lines.append(f"  within {time:g} s per s: {said}")
    for method, mine in of.items():
        why = [p.outcome for p in mine if p.error is None]
        if why:
            said = "; ".join(dict.fromkeys(why))
            lines.append(f"  failed: {method}, {len(why)} of {len(mine)}: {said}")
    return lines


def _show(p: Point) -> str:
    return f"{p.method} ({p.setting}), {p.wall:.3g} s per s, error {p.error:.2g}"
