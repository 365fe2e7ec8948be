"""What a USD stage holds and a scene does not: physics in words, and what is only seen."""

import re
from math import inf

from pxr import UsdGeom, UsdLux

from warp_contact.scene.reading_attachments import JOINTS, PINS
from warp_contact.scene.reading_stage import Reader, note, schemas

PHYSICS = re.compile(r"(?:omni)?physics|physx|newton|mjc|mujoco|drive|limit", re.IGNORECASE)
KNOWN = {  # schemas of which the attributes are read or listed one by one
    "PhysicsRigidBodyAPI",
    "PhysicsMassAPI",
    "PhysicsMaterialAPI",
    "PhysicsCollisionAPI",
    "PhysicsMeshCollisionAPI",
    *("PhysicsBodyAPI", "OmniPhysicsBodyAPI"),
    *("PhysicsDeformableBodyAPI", "OmniPhysicsDeformableBodyAPI", "PhysxDeformableBodyAPI"),
    *("PhysicsVolumeDeformableSimAPI", "OmniPhysicsVolumeDeformableSimAPI"),
    *("PhysicsVolumeDeformableMaterialAPI", "OmniPhysicsDeformableMaterialAPI"),
    *("OmniPhysicsBaseMaterialAPI", "PhysxDeformableBodyMaterialAPI"),
}
TYPES = {"PhysicsScene", *JOINTS, *PINS}
USUAL = {  # values that ask for nothing, by the names of attributes
    "collisionEnabled": True,
    "startsAsleep": False,
    "simulationOwner": None,
    "restitution": 0.0,
    "approximation": "none",
    **{"lowerLimit": -inf, "upperLimit": inf, "breakTorque": inf},
    **{"coneAngle0Limit": -1.0, "coneAngle1Limit": -1.0, "excludeFromArticulation": False},
    "damping": 0.0,
}
BODIES = {"PhysicsRigidBodyAPI", "PhysicsDeformableBodyAPI", "OmniPhysicsDeformableBodyAPI"}
BODIES |= {"PhysxDeformableBodyAPI"}


def list_others(reader: Reader, tets: list[list[str]]) -> list[str]:
    """Say in ``reader.said`` which physics was not read; return what is only seen.

    ``tets`` are the paths of the TetMeshes of each body.
    """
    taken = {path for body in tets for path in body}
    found: dict[str, list[str]] = {}
    seen: dict[str, list[str]] = {}
    for prim in reader.prims:
        path, kind = str(prim.GetPath()), str(prim.GetTypeName())
        unknown = PHYSICS.match(kind) and kind not in TYPES
        names = [kind] if unknown else []
        names += [name for name in schemas(prim) if PHYSICS.match(name) and name not in KNOWN]
        if BODIES & schemas(prim) and not any(t == path or t.startswith(path + "/") for t in taken):
            names.append("a body without a TetMesh")
        if not unknown:
            names += [in_words(p) for p in prim.GetAuthoredProperties() if is_left(reader, p)]
        shape = prim.IsA(UsdGeom.Gprim) and path not in taken and note(prim, "normal") is None
        if shape and "PhysicsCollisionAPI" in schemas(prim) and not prim.IsA(UsdGeom.Plane):
            names.append(f"a {kind} that collides, without tets")
        elif (shape and not is_own(prim)) or prim.HasAPI(UsdLux.LightAPI):
            seen.setdefault(kind, []).append(path)
        for name in names:
            found.setdefault(name, []).append(path)
    reader.said += [f"{name}: {paths_in_short(paths)}" for name, paths in sorted(found.items())]
    return [f"{kind}, only seen: {paths_in_short(paths)}" for kind, paths in sorted(seen.items())]


def is_left(reader: Reader, prop) -> bool:
    """Whether a property is one of physics, and was neither read nor asks for nothing."""
    space, _, name = prop.GetName().partition(":")
    if not name or not PHYSICS.match(space) or prop.GetPath() in reader.seen:
        return False
    name = name.rpartition(":")[2]
    value = prop.Get() if hasattr(prop, "Get") else None
    return not (name in USUAL and value == USUAL[name])


def in_words(prop) -> str:
    """A property, with its value where that is short."""
    value = str(prop.Get()) if hasattr(prop, "Get") else ""
    return f"{prop.GetName()} = {value}" if 0 < len(value) < 30 else prop.GetName()


def is_own(prim) -> bool:
    """Whether a ``UsdWriter`` has made a shape of what else it writes."""
    above = prim.GetParent()
    surface = note(above, "body") is not None and prim.GetName() == above.GetName()
    return surface or note(prim, "contacts") is not None


def paths_in_short(paths: list[str]) -> str:
    """The first three, and how many more."""
    more = f" and {len(paths) - 3} more" if len(paths) > 3 else ""
    return ", ".join(paths[:3]) + more
