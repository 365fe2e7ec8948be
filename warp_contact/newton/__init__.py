"""A solver for Newton (https://github.com/newton-physics/newton): the extra ``newton``."""

try:
    import newton  # noqa: F401
except ImportError as error:
    hint = "needs Newton: pip install 'warp_contact[newton]'"
    raise ImportError(f"warp_contact.newton {hint}") from error

from warp_contact.newton.solver import SolverContactSurface

__all__ = ["SolverContactSurface"]
