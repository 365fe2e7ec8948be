"""tools/measure/: levels and bounds, runs that stop, the table and the machine."""

import argparse
import math
import sys
from pathlib import Path

import pytest
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

from measure import machine, report, run
from measure.figure import Figure, lowest, relative, zero

from warp_contact import SimulationError

LIMITS = 0.1, 0.01, 0.001


@pytest.mark.parametrize(
    ("error", "level"),
    [(0.0, "best"), (-0.001, "best"), (0.0011, "excellent"), (-0.01, "excellent"), (0.1, "good")]
    + [(-0.11, "missed"), (math.nan, "missed"), (math.inf, "missed")],
)
def test_a_figure_reaches_the_strictest_level_whose_limit_holds(error, level):
    assert zero("case", "name", error, LIMITS).level == level


@pytest.mark.parametrize(("count", "level"), [(1, "ok"), (2, "excellent"), (3, "best")])
def test_the_strictest_of_one_two_or_three_limits(count, level):
    assert zero("case", "name", 0.0, LIMITS[:count]).level == level


@pytest.mark.parametrize(
    ("value", "level"),
    [(1.0, "ok"), (2.0, "ok"), (2.1, "missed"), (0.9, "missed")]
    + [(math.nan, "missed"), (None, "missed")],
)
def test_a_value_is_held_against_its_bounds(value, level):
    assert Figure("case", "name", value, least=1.0, most=2.0).level == level


def test_a_figure_without_limits_or_without_an_error_has_no_level():
    assert Figure("case", "name", 1.0).level == ""
    assert Figure("case", "name", 1.0, limits=LIMITS).level == "missed"


def test_the_error_is_that_of_the_value_against_its_reference():
    assert relative("case", "name", 1.05, 1.0, LIMITS).error == pytest.approx(0.05)
    assert relative("case", "name", -1.0, -2.0).error == -0.5


def test_a_case_holds_the_lowest_level_of_its_figures():
    best, good = (zero("case", "name", x, LIMITS) for x in (0.0, 0.05))
    shown, fine = zero("case", "name", 7.0), Figure("case", "name", 1.0, most=1.0)
    assert lowest([best, shown]) == "best"
    assert lowest([good, best, fine]) == "good"
    assert lowest([good, zero("case", "name", math.nan, LIMITS)]) == "missed"
    assert lowest([shown]) == ""


def test_a_run_that_stops_keeps_its_figures_and_misses(capsys):
    def stops():
        yield zero("first", "name", 0.0, LIMITS)
        raise SimulationError("no step")

    fine = Figure("second", "name", 1.0, most=2.0)
    found = run.run({"stops": stops, "fine": lambda: [fine]})
    assert [lowest(figures) for figures in found.values()] == ["missed", "ok"]
    assert run.status(found) == 1
    assert run.status({"fine": found["fine"]}) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    assert lines[1].startswith("stops") and lines[1].endswith("no step")


def test_names_that_there_are_not_are_refused():
    assert run.one_of(("a", "b"))("b") == "b"
    with pytest.raises(argparse.ArgumentTypeError, match="no 'c'; there are a, b"):
        run.one_of(("a", "b"))("c")
    with pytest.raises(argparse.ArgumentTypeError, match="count from 1"):
        run.count("0")


def test_a_line_has_four_digits_and_the_target_exact_or_by_its_bounds():
    line = report.line(relative("case", "force [N]", 1.05, 1.0, LIMITS))
    assert line.split() == ["case", "force", "[N]", "1.05", "1", "0.05", "good"]
    line = report.line(Figure("", "time", None, least=0.123456, most=2.0, note="!"))
    assert line.split() == ["time", ">=", "0.1235", "<=", "2", "missed", "!"]


def test_the_machine_is_named_with_versions():
    line = machine.line("cpu")
    assert f"warp-lang {wp.__version__}," in line and ", cpu: " in line
