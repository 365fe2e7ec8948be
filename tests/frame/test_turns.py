"""turns.py: when worlds begin within a frame, and when they are looked at."""

import numpy as np
import pytest

from warp_contact.frame.turns import segments


@pytest.mark.parametrize("others", [(), (23,), (40, 3), (5, 0), (64,)])
def test_a_world_is_looked_at_after_steps_of_its_own(others):
    n = np.array([21, *others])
    for in_parts in (n == 21, np.ones(len(n), dtype=bool)):
        taken, looks = np.zeros(len(n), dtype=int), []
        for count, begun, looked in segments(n, in_parts, 8):
            taken += count * begun
            if looked is None or looked[0]:
                looks.append(int(taken[0]))
        assert looks == [8, 16, 21]
        np.testing.assert_array_equal(taken, n)


def test_without_flat_tets_steps_are_taken_at_once():
    for n in ([30], [30, 30], [30, 0]):
        (count, _begun, looked), *rest = segments(np.array(n), np.zeros(len(n), dtype=bool), 8)
        assert (count, looked, rest) == (30, None, [])
