"""What a scene file says beside its ``build()``."""

from types import ModuleType

import numpy as np

from warp_contact import checks
from warp_contact.errors import UsageError
from warp_contact.step.response import Penalty


def check_scene_file(module: ModuleType, name: str) -> None:
    """Check FRAMES, VIEW and PENALTY, where they are; raises UsageError."""
    try:
        if hasattr(module, "FRAMES"):
            checks.count(module.FRAMES, "FRAMES")
        view = getattr(module, "VIEW", None)
        if view is not None:
            check_view(view)
        if hasattr(module, "PENALTY"):
            checks.instance(module.PENALTY, dict, "PENALTY", "{'stiffness': ..., 'damping': ...}")
            Penalty(**module.PENALTY)
    except (ValueError, TypeError) as error:
        raise UsageError(f"{name}: {error}") from error


def check_view(view) -> None:
    """Check that there are an eye and a target, and a direction from one to the other."""
    if not isinstance(view, dict) or set(view) != {"eye", "target"}:
        raise checks.refuse("VIEW", view, "{'eye': (x, y, z), 'target': (x, y, z)}")
    eye, target = (checks.numbers(view[key], (3,), f"VIEW {key}") for key in ("eye", "target"))
    if np.linalg.norm(eye - target) < checks.SMALLEST:
        raise checks.refuse("VIEW", view, "an eye that is not in the place of the target")
