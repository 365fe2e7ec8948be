"""The maps: a table with a row per cell, and a picture per sweep (``picture.py``)."""

import csv
import sys
from functools import partial
from pathlib import Path

from trials.outcome import OUTCOMES, Record, classify
from trials.sweeps import MOST_STEPS, SWEEPS
from trials.watch import METHODS, attempt

COLUMNS = (
    *("sweep", "method", "x_name", "x", "y_name", "y", "outcome", "overlap", "energy_gained"),
    *("lowest_volume", "end_volume", "tunnelled", "touched", "steps", "time", "asked", "reason"),
)
LIMIT = 30.0  # seconds that a cell may take


def draw(names: list[str], quick: bool, out: Path) -> int:
    """Run the sweeps, write the table as they go and a picture after each."""
    try:
        from trials.picture import picture
    except ImportError:
        print("no matplotlib: pip install 'warp_contact[plot]'", file=sys.stderr)
        return 1
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "map.csv", "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(COLUMNS)
        for name in names:
            found = {}
            for method in METHODS:
                found[method] = sweep(name, method, quick, table.writerow)
                file.flush()
            picture(SWEEPS[name], quick, found, out / f"{name}.png")
    return 0


def sweep(name: str, method: str, quick: bool, write) -> list[list[str]]:
    """The outcomes of all cells of a method, by rows of equal y; ``write`` takes each row."""
    s = SWEEPS[name]
    xs, ys = (axis.tolist() for axis in s.axes(quick))
    limits = {"most_steps": MOST_STEPS[not quick], "limit": LIMIT}
    outcomes = []
    for y in ys:
        for x in xs:
            r = attempt(partial(s.build, x, y), method, **limits)
            outcomes.append(classify(r))
            write((name, method, s.x_name, x, s.y_name, y, *row(r)))
    counts = ", ".join(f"{o} {outcomes.count(o)}" for o in OUTCOMES if o in outcomes)
    print(f"{name:8}  {method:14}  {counts}", flush=True)
    return [outcomes[k : k + len(xs)] for k in range(0, len(outcomes), len(xs))]


def row(r: Record) -> tuple:
    """The figures of a cell."""
    state = r.overlap, r.gained, r.lowest, r.volume, r.tunnelled
    return classify(r), *state, r.touched, r.steps, r.time, r.asked, r.reason
