"""The methods that are compared, and an attempt at a setting with one of them."""

from collections.abc import Callable

import warp_contact as wc
from trials.outcome import Record
from trials.watch import Setting, run, stiffness

FACTORS = 0.01, 0.1, 1.0, 10.0, 100.0  # of E l, the stiffness of the softest body's tets
METHODS = "surface", "literal", *(f"penalty {f:g}" for f in FACTORS)


def response(method: str, scene: wc.Scene):
    """The response of a method; a penalty's stiffness is a factor of that of the scene."""
    if method == "surface":
        return wc.ContactSurface()
    if method == "literal":
        return wc.ContactSurface("literal")
    return wc.Penalty(float(method.split()[1]) * stiffness(scene))


def attempt(build: Callable[[], Setting], method: str = METHODS[0], **limits) -> Record:
    """Build a setting and run it; what cannot be built is refused."""
    try:
        setting = build()
    except ValueError as error:
        return Record(refused=str(error))
    return run(setting, response(method, setting.scene), **limits)
