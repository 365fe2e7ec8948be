"""What became of a run: the figures of it, one word for it, the level it holds.

    fine        none of the following
    refused     an error before the first step
    not finite  a position or velocity is not a number
    stopped     the solver found no step, or the run took longer than it may
    lost        a body is on the wrong side of another body or of a plane, or points of it went
                through the other (``tunnelled`` of ``measure()``)
    inverted    a tet is inside out or flat at the end; on the way it only costs a level
    energy      the total energy rose by more than ``GAIN`` of its scale
    overlap     the deepest overlap was more than ``SUNK`` of the thinnest body

A run has the first of these that applies, in the order refused, not finite, stopped, lost, ...
"""

from dataclasses import dataclass

from measure.figure import EXCELLENT, GOOD, MISSED

FINE, REFUSED, INFINITE, STOPPED = "fine", "refused", "not finite", "stopped"
LOST, INVERTED, ENERGY, OVERLAP = "lost", "inverted", "energy", "overlap"
OUTCOMES = FINE, OVERLAP, ENERGY, INVERTED, LOST, STOPPED, INFINITE, REFUSED

SUNK = 0.05  # overlap, of the smallest extent of a body
GAIN = 0.01  # energy, of its scale: see watch.py
FLAT = 0.0  # volume of a tet at the end, of that at rest
EXCELLENT_SUNK, EXCELLENT_GAIN = 0.01, 0.001  # and no tet inverts on the way
BEYOND = "beyond"  # expected of what has a meaning, but not for this method
ELEMENTS = "body", "tet", "substeps"


@dataclass
class Record:
    """Figures of a run."""

    refused: str = ""  # the error before the first step
    error: str = ""  # the error that ended the run
    finite: bool = True  # all positions and velocities were numbers
    lost: str = ""  # who was on whose wrong side
    tunnelled: int = 0  # points that went through another body, if it started without an overlap
    through: tuple[str, str] | None = None  # the bodies of the last of them
    # Deepest of all frames, or of the last one if it started with one; of the thinnest body.
    overlap: float = 0.0
    gained: float = 0.0  # largest rise of the energy over its scale; 0 for bodies that are driven
    volume: float = 1.0  # smallest volume of a tet at the end, of that at rest
    lowest: float = 1.0  # the same at any frame
    touched: bool = False  # there was some contact
    steps: int = 0  # taken
    time: float = 0.0  # of the run [s]
    asked: float = 0.0  # that it should have lasted [s]
    note: str = ""  # a further figure, in words

    @property
    def reason(self) -> str:
        """What there is to say beyond the outcome."""
        passed = "{} points, of {} through {}".format(self.tunnelled, *self.through or ("", ""))
        said = self.refused, self.error, self.lost, passed if self.through else ""
        return next(filter(None, said), self.note)


def classify(r: Record) -> str:
    """The outcome of a run; a figure that is not a number is beyond its limit."""
    failures = {
        REFUSED: bool(r.refused),
        INFINITE: not r.finite,
        STOPPED: bool(r.error),
        LOST: bool(r.lost) or r.tunnelled > 0,
        INVERTED: not r.volume > FLAT,
        ENERGY: not r.gained <= GAIN,
        OVERLAP: not r.overlap <= SUNK,
    }
    return next((name for name, failed in failures.items() if failed), FINE)


def level(r: Record, expect: str = FINE) -> str:
    """The level of a run.

    It is expected to be ``fine``, or ``beyond``, where a refusal is good at most and has to name
    the body, tet or argument that is wrong.
    """
    found = classify(r)
    if expect == BEYOND:
        named = any(word in r.refused for word in ELEMENTS)
        return GOOD if found == REFUSED and named else MISSED
    if found != FINE:
        return MISSED
    clean = r.overlap <= EXCELLENT_SUNK and r.gained <= EXCELLENT_GAIN and r.lowest > FLAT
    return EXCELLENT if clean else GOOD
