"""The progress line of a run."""

import sys
import time
from contextlib import suppress
from typing import TextIO

INTERVAL = 0.1  # between two writes of the line [s]


class Progress:
    """Frame, time, steps, contacts, deepest overlap and time to go, on one line of a terminal.

    Nothing is written where the stream is not a terminal, or when ``quiet``.
    """

    def __init__(self, n_frames: int, quiet: bool = False, stream: TextIO | None = None):
        """Start the clock; ``stream`` is stderr by default."""
        self.stream = sys.stderr if stream is None else stream
        self.active = not quiet and self.stream.isatty()
        self.n_frames = n_frames
        self.done = self.width = 0
        self.start = self.written = time.monotonic()
        self._write(f"frame 0/{n_frames}")

    def expect(self, steps: int) -> None:
        """Say how many steps the first frame will take: it may last."""
        self._write(f"frame 0/{self.n_frames}  {steps} steps a frame")

    def update(self, sim, measured) -> None:
        """Count a finished frame of a simulation, and what was measured of it."""
        self.done += 1
        now = time.monotonic()
        last = self.done == self.n_frames
        if not last and self.done > 1 and now - self.written < INTERVAL:
            return
        self.written = now
        left = (now - self.start) / self.done * (self.n_frames - self.done)
        itself = measured.self_overlap
        overlap = f"overlap {measured.overlap:.1e} m  "
        overlap += f"self-overlap {itself:.1e} m  " if itself > 0.0 else ""
        self._write(
            f"frame {sim.frame} ({self.done}/{self.n_frames})  t {sim.time:.3f} s  "
            f"{sim.substeps} steps  {measured.n_contacts} contacts  "
            + overlap
            + ("done" if last else f"{clock(left)} to go")
        )

    def close(self) -> None:
        """End the line."""
        if self.active and self.width:
            self._put("\n")
            self.width = 0

    def __enter__(self):
        """Return the line."""
        return self

    def __exit__(self, *_):
        """End the line."""
        self.close()

    def _write(self, text: str) -> None:
        """Replace the line."""
        if self.active:
            self._put("\r" + text.ljust(self.width))
            self.width = len(text)

    def _put(self, text: str) -> None:
        """Write; a terminal that is gone ends the line, not the run."""
        try:
            self.stream.write(text)
            self.stream.flush()
        except OSError:
            self.active = False


def announce(text: str, quiet: bool = False, stream: TextIO | None = None) -> None:
    """Write a line where ``Progress`` would: what a terminal is to show before the first frame."""
    stream = sys.stderr if stream is None else stream
    if not quiet and stream.isatty():
        with suppress(OSError):  # a terminal that is gone
            stream.write(text + "\n")
            stream.flush()


def clock(seconds: float) -> str:
    """A duration as m:ss or h:mm:ss."""
    minutes, s = divmod(round(seconds), 60)
    h, m = divmod(minutes, 60)
    return f"{h}:{m:02d}:{s:02d}" if h else f"{m}:{s:02d}"
