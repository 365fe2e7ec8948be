"""The maps: a table with a row per cell, and a picture per sweep (``picture.py``)."""

import csv
import sys
from functools import partial
from pathlib import Path

from trials.outcome import OUTCOMES, classify
from trials.sweeps import SWEEPS
from trials.watch import METHODS, attempt

FIGURES = {  # of a cell: its columns, and the fields of its record
    "overlap": "overlap",
    "energy_gained": "gained",
    "lowest_volume": "lowest",
    "end_volume": "volume",
    **{name: name for name in ("tunnelled", "touched", "steps", "time", "asked", "reason")},
}
COLUMNS = "sweep", "method", "x_name", "x", "y_name", "y", "outcome", *FIGURES
CUT = {"most_steps": 6000, "limit": 30.0}  # steps and seconds that a cell may take


def draw(names: list[str], out: Path) -> int:
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
            found = {method: sweep(name, method, table.writerow) for method in METHODS}
            picture(SWEEPS[name], found, out / f"{name}.png")
    return 0


def sweep(name: str, method: str, write) -> list[list[str]]:
    """The outcomes of all cells of a method, by rows of equal y; ``write`` takes each row."""
    s, grid = SWEEPS[name], []
    xs, ys = (axis.tolist() for axis in s.axes())
    for y in ys:
        grid.append([])
        for x in xs:
            r = attempt(partial(s.build, x, y), method, **CUT)
            grid[-1].append(classify(r))
            figures = [getattr(r, field) for field in FIGURES.values()]
            write((name, method, s.x[0], x, s.y[0], y, classify(r), *figures))
    outcomes = [o for row in grid for o in row]
    counts = ", ".join(f"{o} {outcomes.count(o)}" for o in OUTCOMES if o in outcomes)
    print(f"{name:8}  {method:14}  {counts}", flush=True)
    return grid
