"""The table on the screen, a line for each figure, and the file of all of them.

A file ends in ``.csv`` or ``.json``. CSV has a column for each field of the figures, with all
digits, below a line with the machine; JSON has the machine and the values by ``case.name``.
"""

import csv
import json
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

from measure import machine
from measure.figure import Figure


class Table:
    """Columns of text; the last one is as long as its text."""

    def __init__(self, **widths: int):
        """Each column with its width in characters."""
        self.widths = widths

    def line(self, *cells: str) -> str:
        """A line of the table."""
        padded = (c.ljust(w) for c, w in zip(cells, self.widths.values(), strict=True))
        return "  ".join(padded).rstrip()

    def head(self) -> str:
        """The names of the columns, underlined."""
        names = self.line(*self.widths)
        return f"{names}\n{'-' * (sum(self.widths.values()) + 2 * len(self.widths) - 2)}"


FIGURES = Table(case=46, figure=50, value=11, target=13, error=10, level=9, note=0)


def line(f: Figure) -> str:
    """A figure as a line of ``FIGURES``; its target is the reference or the bounds."""
    target = [number(f.reference)] if f.reference is not None else []
    target += [f">= {number(f.least)}"] if f.least is not None else []
    target += [f"<= {number(f.most)}"] if f.most is not None else []
    numbers = number(f.value), " ".join(target), number(f.error)
    return FIGURES.line(f.case, f.name, *numbers, f.level, f.note)


def number(value: float | None) -> str:
    """Four digits, or nothing for None."""
    return "" if value is None else f"{value:.4g}"


def write(path: str | Path, figures: Sequence[Figure], device=None, title: str = "") -> None:
    """Write all figures and where they come from as CSV or JSON, by the ending of ``path``.

    A table of CSV has its ``title`` beside the machine.
    """
    if Path(path).suffix == ".json":
        values = {f"{f.case}.{f.name}".lstrip("."): f.value for f in figures}
        text = json.dumps(machine.about(device) | {"figures": values}, indent=1)
        Path(path).write_text(text + "\n", encoding="utf-8")
        return
    names = [field.name for field in fields(figures[0])]
    with open(path, "w", newline="", encoding="utf-8") as file:
        file.write(f"# {machine.line(device)}; {title}\n")
        out = csv.writer(file)
        out.writerow([*names, "level"])
        out.writerows([*(getattr(f, name) for name in names), f.level] for f in figures)
