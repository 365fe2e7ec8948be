"""Warnings as a command says them."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def warned() -> Iterator[None]:
    """Say each warning of the package within in one line on stderr, without a place in the code."""
    with warnings.catch_warnings():
        warnings.filterwarnings("always", category=UserWarning)
        warnings.showwarning = say
        yield


def say(message, category, filename, lineno, file=None, line=None) -> None:
    """Write a warning."""
    print(f"warp-contact: warning: {' '.join(str(message).split())}", file=sys.stderr)
