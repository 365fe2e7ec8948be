"""Run named cases, print their figures as they come, and say how it went."""

import argparse
from collections.abc import Callable, Collection, Iterable, Mapping

import warp as wp

from measure import report
from measure.figure import MISSED, Figure, Figures, lowest
from warp_contact import SimulationError


def run(cases: Mapping[str, Callable[[], Iterable[Figure]]]) -> dict[str, list[Figure]]:
    """The figures of every case by its name, each printed as it comes.

    A case that ends with a ``SimulationError`` keeps the figures that it has and misses.
    """
    found = {}
    for name, case in cases.items():
        found[name] = []
        for figure in _guarded(name, case):
            found[name].append(figure)
            print(report.line(figure), flush=True)
    return found


def _guarded(name: str, case: Callable) -> Figures:
    try:
        yield from case()
    except SimulationError as error:
        yield Figure(name, "stopped early", None, most=0.0, note=str(error))


def status(found: Mapping[str, Iterable[Figure]]) -> int:
    """The exit status of a tool: 1 when any figure is missed."""
    return int(any(lowest(figures) == MISSED for figures in found.values()))


def command_line(doc: str) -> argparse.ArgumentParser:
    """The parser of the command line of a tool, described by ``doc``; Warp only warns then."""
    wp.config.log_level = wp.LOG_WARNING
    raw = argparse.RawDescriptionHelpFormatter
    return argparse.ArgumentParser(description=doc, formatter_class=raw)


def one_of(known: Collection[str]) -> Callable[[str], str]:
    """The type of a command line argument that names one of ``known``."""

    def name(text: str) -> str:
        if text not in known:
            raise argparse.ArgumentTypeError(f"no '{text}'; there are {', '.join(known)}")
        return text

    return name


def count(text: str) -> int:
    """The type of a command line argument that is a whole number from 1."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a count from 1")
    return int(text)
