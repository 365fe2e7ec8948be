"""Types of command line options."""

import argparse


def count(text: str) -> int:
    """A whole number from 1."""
    try:
        n = int(text)
    except ValueError:
        n = 0
    if n < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a count from 1")
    return n
