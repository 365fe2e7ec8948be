"""Every argument of the public API that cannot work is refused where it is given."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "trials"))
import misuse


def test_each_wrong_call_is_refused_in_one_line():
    calls = misuse.calls()
    assert len(calls) > 900
    assert {call: said for call in calls if (said := misuse.answer(call))} == {}


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ("wc.Scene(friction=(0.2, 0.3))", "friction (0.2, 0.3): give a number of 0 or more"),
        ("wc.Simulation(scene(), fps='60')", "fps '60': give a number from 1e-06 to 1e+12"),
        ("wc.VirtualSurface(0)", "penalty stiffness 0: give a number above 0, from 1e-18 to 1e+18"),
        ("wc.Penalty(-1)", "penalty stiffness -1: give a number above 0, from 1e-18 to 1e+18"),
        ("add(world=2**40)", "world 1099511627776: give a whole number from 0 to 2147483647"),
        ("sim().positions(1.5)", "body 1.5: give a body, its label or its index"),
        ("mesh().save('')", "path '': give a path"),
    ],
)
def test_the_reason_has_name_value_and_remedy(call, words):
    names = misuse.NAMES | {"scene": misuse.scene, "add": misuse.add, "attach": misuse.attach}
    assert misuse.answer(call) == ""
    with pytest.raises(ValueError) as caught:
        eval(call, names)
    assert words in str(caught.value)
