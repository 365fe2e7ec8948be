"""The bowl of fruit for two seconds, in 64 steps a frame: long on a CPU."""

from collections.abc import Iterator

import warp_contact as wc
from checks.scenes import DURATION, FPS, play, rows
from checks.table import Row
from warp_contact import scenes

SUBSTEPS = 64
QUICK = {"fraction": 0.2}, 0.25  # settings, [s]


def run(quick: bool) -> Iterator[Row]:
    """One run with contact surfaces."""
    settings, duration = QUICK if quick else ({}, DURATION)
    scene = scenes.load("bowl").build(**settings)
    result = play(scene, wc.ContactSurface(), round(duration * FPS), SUBSTEPS)
    yield from rows("bowl", result, True)
