"""A run over time in one figure, from its ``metrics.jsonl``: a panel for each kind of figure."""

import json
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

METRICS = "metrics.jsonl"
STRONGEST = 7  # pairs of bodies that have a name; more are grey
DPI = 120
Curves = dict[str, np.ndarray]  # of each label the values, shape (n_frame,); NaN is a gap


def energies(lines: list[dict]) -> Curves:
    """Energies [J], the gravitational one from the first frame on, and their sum."""
    found = {name: values(lines, name) for name in ("kinetic", "elastic", "gravitational")}
    found["gravitational"] = found["gravitational"] - found["gravitational"][0]
    return {**found, "sum": np.sum(list(found.values()), axis=0)}


def forces(lines: list[dict]) -> Curves:
    """Size of the force of each pair [N], the strongest first; 0 where it does not touch."""
    pairs = {(a, b): None for line in lines for a, of in line["forces"].items() for b in of}
    found = {}
    for a, b in pairs:
        sizes = [line["forces"].get(a, {}).get(b, 0.0) for line in lines]
        found[f"{a} and {b}"] = np.array(sizes, dtype=float)
    peak = {label: np.nanmax(sizes, initial=0.0) for label, sizes in found.items()}
    return {label: found[label] for label in sorted(found, key=peak.get, reverse=True)}


def named(**fields: str) -> Callable[[list[dict]], Curves]:
    """A panel of fields of a line, by label."""
    return lambda lines: {
        label.replace("_", " "): values(lines, name) for label, name in fields.items()
    }


def axes(name: str) -> Callable[[list[dict]], Curves]:
    """A panel of the three components of a field."""
    return lambda lines: dict(zip("xyz", values(lines, name).T, strict=True))


PANELS: dict[str, tuple[str, Callable[[list[dict]], Curves]]] = {
    "energy": ("energies [J]", energies),
    "momentum": ("momentum [kg m/s]", axes("momentum")),
    "spin": ("angular momentum about the origin [kg m²/s]", axes("angular_momentum")),
    "overlap": (
        "deepest overlap [m]",
        named(of_two_bodies="overlap", of_a_body_with_itself="self_overlap"),
    ),
    "force": ("mean contact force in a frame [N]", forces),
    "contact": (
        "contacts of the last step",
        named(contacts="n_contacts", deep_but_not_held="unheld", unsolved="unsolved"),
    ),
}


def values(lines: list[dict], name: str) -> np.ndarray:
    """A field of all lines; null, for what was not finite, is NaN."""
    return np.array([line[name] for line in lines], dtype=float)


def read_metrics(path) -> list[dict]:
    """The lines of a run: of its folder, or of the file itself.

    A last line without its end is that of a run that was killed, and left out.

    Raises:
        OSError: there is no such file
        ValueError: a line is damaged, or there is none
    """
    path = Path(path)
    path = path / METRICS if path.is_dir() else path
    text = path.read_bytes().decode(errors="replace")
    whole = text[: text.rfind("\n") + 1].splitlines()
    lines = []
    for number, line in enumerate(whole, 1):
        try:
            found = json.loads(line)
            for _, panel in PANELS.values():
                panel([found])
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"{path}: line {number} is not one of a run: {error}") from error
        lines.append(found)
    if not lines:
        raise ValueError(f"{path} holds no frame")
    return lines


def plot(lines: list[dict], path, kinds: Iterable[str] = PANELS, title: str = "") -> None:
    """Draw figures of a run over time, and write them in the format that the suffix names.

    Args:
        lines: as ``read_metrics`` gives them
        path: such as ``metrics.png``, ``.svg`` or ``.pdf``
        kinds: which panels, of ``PANELS``
        title: over all panels

    Raises:
        ImportError: matplotlib is not installed
        ValueError: for a suffix that it does not know
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("plots need matplotlib: pip install 'warp_contact[plot]'") from error
    kinds = list(dict.fromkeys(kinds))
    columns = min(len(kinds), 3)
    rows = -(-len(kinds) // columns)
    figure = Figure(figsize=(4.6 * columns, 3.0 * rows + 0.3), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    for ax in grid.flat[len(kinds) :]:
        ax.set_visible(False)
    for ax, kind in zip(grid.flat, kinds, strict=False):
        name, panel = PANELS[kind]
        draw(ax, values(lines, "time"), panel(lines))
        ax.set_title(name, fontsize=10)
        ax.set_xlabel("time [s]", fontsize=8)
    figure.suptitle(title, fontsize=11)
    figure.savefig(path, dpi=DPI)


def draw(ax, time: np.ndarray, curves: Curves) -> None:
    """Curves in a panel, the first ones with a label; a single frame is a dot."""
    style = {"lw": 1.2, "marker": "o" if len(time) == 1 else ""}
    for number, (label, curve) in enumerate(curves.items()):
        rest = len(curves) - STRONGEST
        if number < STRONGEST:
            ax.plot(time, curve, label=label, zorder=len(curves) - number + 2, **style)
        else:
            label = f"{rest} weaker pairs" if number == STRONGEST else None
            ax.plot(time, curve, color="0.7", label=label, zorder=1, **style | {"lw": 0.5})
    ax.tick_params(labelsize=8)
    ax.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4))
    ax.margins(x=0.01)
    ax.grid(alpha=0.25)
    if curves:
        ax.legend(fontsize=7)
