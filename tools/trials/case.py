"""A case: its name, how to build its setting, and what ought to come of it."""

from collections.abc import Callable
from dataclasses import dataclass

import warp_contact as wc
from trials.outcome import FINE
from trials.watch import Setting

G = 9.81  # [m/s^2]
DOWN = 0.0, 0.0, -G
NONE = 0.0, 0.0, 0.0
UP = 0.0, 0.0, 1.0


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes:
        name: number in the specification and a few words
        build: its setting; raises ValueError where the input is refused
        expect: ``fine``, ``refused``, or ``beyond`` for what is refused though it has a meaning
        limit: seconds that it may take
    """

    name: str
    build: Callable[[], Setting]
    expect: str = FINE
    limit: float = 120.0


def soft(young: float = 1e5, density: float = 1000.0, poisson: float = 0.4) -> wc.NeoHookean:
    """A material without damping: nothing but the contact may take energy out."""
    return wc.NeoHookean(young, poisson, density)
