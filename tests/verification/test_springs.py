"""A1: overlapping columns, and a stack of cubes, against springs in series."""

import pytest
from verification import springs
from verification.setup import Pose

VARIANTS = (4, "structured", False), (6, "jittered", True)


def test_the_closed_form_meets_published_numbers():
    """Equal springs halve an overlap; 1 : 10 leaves the soft one 10 / 11 of it."""
    equal, ratio = springs.CASES["equal"], springs.CASES["ratio 10"]
    assert equal.exact == pytest.approx((5000.0, 0.95))
    assert ratio.exact == pytest.approx((1e5 / 11.0, 1.0 - 0.1 * 10.0 / 11.0))
    assert springs.CASES["gravity"].exact[0] == pytest.approx(12547.5)


@pytest.mark.parametrize(("across", "mesh", "turned"), VARIANTS)
@pytest.mark.parametrize("name", springs.CASES)
def test_columns_share_their_overlap_like_springs(name, across, mesh, turned, hold):
    figures = springs.press(name, across, mesh, Pose(turned))
    hold(figures, "excellent")


def test_the_pressure_does_not_depend_on_the_damping_of_the_material(hold):
    figures = list(springs.press("equal", 6, "structured", Pose(), springs.DAMPED))
    hold(figures, "excellent")


@pytest.mark.parametrize("cells", springs.CELLS)
def test_a_stack_of_cubes_carries_the_weight_above_each(cells, hold):
    hold(springs.stand(cells, "structured", Pose()), "excellent")
