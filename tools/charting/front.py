"""Who is ahead: Pareto dominance of wall time and error, both the smaller the better."""

from charting.result import Point


def dominates(a: Point, b: Point) -> bool:
    """Whether ``a`` is no worse in time and error, and better in one; failures dominate nothing."""
    if a.failed:
        return False
    if b.failed:
        return True
    no_worse = a.wall <= b.wall and a.error <= b.error
    return no_worse and (a.wall < b.wall or a.error < b.error)


def front(points: list[Point]) -> list[Point]:
    """The points that none dominates, the fastest first; failures are never among them."""
    kept = [p for p in points if not p.failed and not any(dominates(q, p) for q in points)]
    return sorted(kept, key=lambda p: p.wall)


def best_knob(points: list[Point], knob) -> object:
    """The value of ``knob(point)`` whose points reach the smallest error; None if all failed."""
    fine = [p for p in points if not p.failed]
    return knob(min(fine, key=lambda p: p.error)) if fine else None


def fastest_below(points: list[Point], error: float) -> Point | None:
    """The quickest point with at most this error."""
    fine = [p for p in points if not p.failed and p.error <= error]
    return min(fine, key=lambda p: p.wall, default=None)
