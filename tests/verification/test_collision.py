"""A6: free collisions keep momenta and never gain energy."""

import pytest
from verification import collision


@pytest.mark.parametrize("ratio", collision.DENSITIES)
@pytest.mark.parametrize("way", collision.WAYS)
def test_blocks_keep_their_momenta_and_gain_no_energy(way, ratio, hold):
    hold(collision.hit((3, 5), way, ratio), "excellent")
