"""figure.py: levels and the lowest of them."""

import math

import pytest
from verification.figure import Figure, lowest, relative, zero

LIMITS = 0.1, 0.01, 0.001


@pytest.mark.parametrize(
    ("error", "level"),
    [(0.0, "best"), (-0.001, "best"), (0.0011, "excellent"), (-0.01, "excellent"), (0.1, "good")]
    + [(-0.11, "-"), (math.nan, "-"), (math.inf, "-")],
)
def test_a_figure_reaches_the_strictest_level_whose_limit_holds(error, level):
    assert zero("case", "name", error, LIMITS).level == level


def test_a_figure_without_limits_or_without_an_error_has_no_level():
    assert Figure("case", "name", 1.0).level == ""
    assert Figure("case", "name", 1.0, limits=LIMITS).level == "-"


def test_the_error_is_that_of_the_value_against_its_reference():
    assert relative("case", "name", 1.05, 1.0, LIMITS).error == pytest.approx(0.05)
    assert relative("case", "name", -1.0, -2.0).error == -0.5


def test_a_case_holds_the_lowest_level_of_its_figures():
    best, good = (zero("case", "name", x, LIMITS) for x in (0.0, 0.05))
    shown = zero("case", "name", 7.0)
    assert lowest([best, shown]) == "best"
    assert lowest([good, best]) == "good"
    assert lowest([good, zero("case", "name", math.nan, LIMITS)]) == "-"
    assert lowest([shown]) == ""
