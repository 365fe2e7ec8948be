"""A5: Coulomb friction."""

import pytest
from verification import friction


@pytest.mark.parametrize("mu", [0.0, 0.25, 0.45])
def test_a_block_slides_down_a_slope_as_coulomb_says(mu, ask, hold):
    hold(friction.slope(ask, friction.SLOPE, mu), "excellent")


def test_a_block_just_below_the_limit_slides_slowly(ask, hold):
    hold(friction.slope(ask, friction.SLOPE, 0.49), "excellent")


@pytest.mark.parametrize("mu", [0.51, 0.8])
def test_a_block_above_the_limit_stays(mu, ask, hold):
    hold(friction.slope(ask, friction.SLOPE, mu), "excellent")


@pytest.mark.parametrize(("speed", "mu"), [(1.0, 0.1), (2.0, 0.3)])
def test_a_block_slides_to_a_stop(speed, mu, ask, hold):
    hold(friction.stop(ask, speed, mu, degrees=30.0), "excellent")


@pytest.mark.parametrize("degrees", [0.0, 17.0, 45.0])
def test_friction_acts_against_the_motion_in_every_direction(degrees, ask, hold):
    hold(friction.stop(ask, 0.5, 0.3, degrees), "excellent")


@pytest.mark.parametrize("ratio", friction.TALL)
def test_a_slender_block_falls_over_and_a_wide_one_stands(ratio, ask, hold):
    hold(friction.tip(ask, ratio), "best")
