"""How the command line ends when it is told to: at any time, in one line, with 128 + the signal.

The package imports this first, as all that comes after it takes a second. It imports little itself,
as until then Python has its own way. A program that uses the package keeps its own too.
"""

import os
import signal
import sys

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
_last = 0  # the signal that came, until it is seen


class Interrupted(KeyboardInterrupt):
    """A signal that ends the command came."""

    def __init__(self, number: int):
        """The signal ``number``."""
        super().__init__(signal.Signals(number).name)
        self.number = number


class Raised:
    """Within, the first of the signals raises ``Interrupted``, a second one ends the process."""

    def __enter__(self) -> None:
        """Handle the signals; in a thread none comes."""
        self._hook, self._before = sys.unraisablehook, _handle(_raise)
        sys.unraisablehook = lambda found: None if _last else self._hook(found)

    def __exit__(self, *_) -> None:
        """Handle them as before; at the end of the process, which takes a moment, not at all."""
        global _last
        _last = 0
        sys.unraisablehook = self._hook
        for number, handler in self._before.items():
            signal.signal(number, signal.SIG_IGN if handler is _leave else handler)


def check() -> None:
    """Raise ``Interrupted`` if a signal came where Python drops exceptions, as in ``__del__``."""
    if _last:
        raise Interrupted(_last)


def _raise(number: int, _) -> None:
    global _last
    _last = number
    _handle(_leave)
    raise Interrupted(number)


def _leave(number: int, _) -> None:
    try:
        os.write(2, b"\nwarp-contact: error: interrupted\n")
    except OSError:  # a terminal that is gone
        pass
    os._exit(128 + number)


def _handle(by) -> dict:
    """Let the signals be handled, but those that are ignored, as by nohup; return what did it."""
    numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in numbers}
    before = {number: old for number, old in before.items() if old is not signal.SIG_IGN}
    try:
        for number in before:
            signal.signal(number, by)
    except ValueError:  # not in the main thread
        return {}
    return before


def _is_command_line() -> bool:
    """Whether this process is ``warp-contact``, or about to be ``python -m warp_contact``."""
    name = os.path.basename(sys.argv[0]) if sys.argv else ""
    if name == "-m":
        return "warp_contact" in sys.orig_argv[sys.orig_argv.index("-m") :][1:2]
    return os.path.splitext(name)[0] == "warp-contact"


if _is_command_line():
    _handle(_leave)
