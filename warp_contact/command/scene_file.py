"""What a scene file says beside its ``build()``."""

from types import ModuleType

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
            if not isinstance(view, dict) or set(view) != {"eye", "target"}:
                raise checks.refuse("VIEW", view, "{'eye': (x, y, z), 'target': (x, y, z)}")
            checks.sight(view["eye"], view["target"], "VIEW ")
        if hasattr(module, "PENALTY"):
            checks.instance(module.PENALTY, dict, "PENALTY", "{'stiffness': ..., 'damping': ...}")
            Penalty(**module.PENALTY)
    except (ValueError, TypeError) as error:
        raise UsageError(f"{name}: {error}") from error
