"""How a part of the method is switched off: by its name, or by a constant."""

from collections.abc import Callable
from contextlib import contextmanager
from functools import partial
from types import ModuleType
from unittest import mock

import warp as wp

from warp_contact.data import switches


def switch(name: str) -> Callable:
    """A context maker: a part that the package can do without by name."""
    if name not in switches.PARTS:
        raise KeyError(name)
    return partial(switches.without, name)


def number(owner: ModuleType, name: str, value: float) -> Callable:
    """A context maker that gives a number of the host another value."""
    getattr(owner, name)
    return lambda: mock.patch.object(owner, name, value)


def constant(owner: ModuleType, name: str, value: float, *users: ModuleType) -> Callable:
    """A context maker that compiles kernels with another constant of ``owner``.

    Those of ``owner``, and of ``users``: modules whose kernels call functions of it.
    """
    getattr(owner, name)

    @contextmanager
    def compiled():
        modules = [wp.get_module(module.__name__) for module in {owner, *users}]
        try:
            with mock.patch.object(owner, name, wp.constant(value)):
                for module in modules:
                    module.mark_modified()
                yield
        finally:
            for module in modules:
                module.mark_modified()

    return compiled
