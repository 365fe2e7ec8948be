"""A5: Coulomb friction."""

import pytest
from verification import friction


@pytest.mark.parametrize("mu", [0.0, 0.25, 0.45])
def test_a_block_slides_down_a_slope_as_coulomb_says(mu, hold):
    hold(friction.slope(mu), "excellent")


def test_a_block_just_below_the_limit_slides_slowly(hold):
    hold(friction.slope(0.49), "excellent")


@pytest.mark.parametrize("mu", [0.51, 0.8])
def test_a_block_above_the_limit_stays(mu, hold):
    hold(friction.slope(mu), "excellent")


@pytest.mark.parametrize(("speed", "mu"), [(1.0, 0.1), (2.0, 0.3)])
def test_a_block_slides_to_a_stop(speed, mu, hold):
    hold(friction.stop(speed, mu, degrees=30.0), "excellent")


@pytest.mark.parametrize("degrees", [0.0, 17.0, 45.0])
def test_friction_acts_against_the_motion_in_every_direction(degrees, hold):
    hold(friction.stop(0.5, 0.3, degrees), "excellent")
