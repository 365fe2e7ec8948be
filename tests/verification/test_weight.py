"""A7: weights at rest."""

import pytest
from verification import weight


@pytest.mark.parametrize("case", ["on a plane", "on a block 3:4"])
def test_a_block_presses_with_its_weight(case, hold):
    hold(weight.stacked(case, weight.STACKS[case]), "excellent")


def test_the_centre_of_pressure_is_below_the_centre_of_mass(hold):
    hold(weight.centre(""), "excellent")


def test_a_membrane_carries_the_weight_of_a_block(hold):
    hold(weight.on_sheet(""), "excellent")


def test_three_points_share_the_weight_as_the_moments_say(hold):
    values = hold(weight.on_points(""), "excellent")
    assert len(set(values.values())) == 3  # they are not alike


@pytest.mark.parametrize("ratio", [1.0, 100.0])
def test_a_light_block_carries_a_heavy_one(ratio, hold):
    hold(weight.carry(ratio), "excellent")
