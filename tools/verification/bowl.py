"""The bowl of fruit for two seconds, in 64 steps a frame: long on a CPU."""

from collections.abc import Iterator

from measure.figure import Figure

import warp_contact as wc
from verification.scenes import DURATION, FPS, figures, play
from verification.setup import Ask
from warp_contact import scenes

SUBSTEPS = 64
QUICK = {"fraction": 0.2}, 0.25  # settings, [s]


def run(ask: Ask) -> Iterator[Figure]:
    """One run with contact surfaces."""
    settings, duration = QUICK if ask.quick else ({}, DURATION)
    scene = scenes.load("bowl").build(**settings)
    yield from figures("bowl", play(scene, wc.ContactSurface(), round(duration * FPS), SUBSTEPS))
