"""The scenes of the paper, one file each: constants with units and ``build()``.

``examples`` holds scripts to start from.
"""

if __name__ != "warp_contact.scenes":
    raise ImportError("import this package as warp_contact.scenes")

from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType


def names() -> list[str]:
    """The scenes there are, in alphabetical order."""
    return sorted(module.name for module in iter_modules(__path__) if not module.ispkg)


def load(name: str) -> ModuleType:
    """Import a scene by its name; raises ValueError if there is none."""
    if name not in names():
        raise ValueError(f"no scene '{name}'; there are {', '.join(names())}")
    return import_module(f"{__name__}.{name}")
