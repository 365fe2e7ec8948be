"""Half-spaces, gravity, friction and restitution of a USD stage."""

import numpy as np
from pxr import UsdGeom

from warp_contact.scene.reading_stage import (
    COLLIDER,
    Reader,
    material_of,
    note,
    schemas,
    tidy,
    times,
)

EARTH = 9.81  # gravity [m/s^2] where a stage leaves it to the reader


def half_spaces(reader: Reader) -> list[dict]:
    """Planes that collide, and those of a UsdWriter: normal, offset [m], coefficients."""
    found = []
    for prim in reader.prims:
        n, h = note(prim, "normal"), note(prim, "offset", 0.0)
        if prim.IsA(UsdGeom.Plane) and COLLIDER in schemas(prim):
            n = np.eye(3)["XYZ".index(UsdGeom.Plane(prim).GetAxisAttr().Get())]
        if n is not None and np.any(n):
            a, t = reader.matrix(prim)
            point = h / np.dot(n, n) * np.array(n) @ a + t
            normal = n @ np.linalg.inv(a).T
            normal /= np.linalg.norm(normal)
            info = {"path": str(prim.GetPath()), "normal": normal.tolist()}
            info |= coefficients_of(reader, material_of(prim))
            found.append(info | {"offset": tidy(float(np.float32(normal @ point)))})
    return found


def surroundings(reader: Reader) -> dict:
    """Gravity [m/s^2], and coefficients of all that has none of its own, if a UsdWriter says it."""
    scenes = [prim for prim in reader.prims if prim.GetTypeName() == "PhysicsScene"]
    reader.said += [f"PhysicsScene {p.GetPath()}: {scenes[0].GetPath()} counts" for p in scenes[1:]]
    if not scenes:
        reader.said.append(f"the stage has no PhysicsScene: gravity taken as {EARTH} downwards")
        return {"gravity": [0.0, 0.0, -EARTH], "friction": None, "restitution": None}
    direction = np.array(reader.physics(scenes[0], "gravityDirection", (0.0, 0.0, 0.0)))
    size = reader.physics(scenes[0], "gravityMagnitude", -1.0)
    size = times(size, reader.length) if size >= 0.0 else EARTH
    down = direction @ reader.turn if direction.any() else np.array([0.0, 0.0, -1.0])
    gravity = size / np.linalg.norm(down) * down
    gravity = tidy(gravity.astype(np.float32))  # as precise as it is written
    own = {name: note(scenes[0], name) for name in ("friction", "restitution")}
    return {"gravity": gravity} | own


def coefficients_of(reader: Reader, look) -> dict[str, float | None]:
    """Of friction and of restitution of a material."""
    restitution = reader.physics(look, "restitution")
    return {"friction": _friction_of(reader, look), "restitution": restitution}


def _friction_of(reader: Reader, look) -> float | None:
    """Coulomb coefficient of a material: the dynamic one, if it has one."""
    dynamic, static = (reader.physics(look, f"{kind}Friction") for kind in ("dynamic", "static"))
    if dynamic is not None and static not in (None, dynamic):
        line = f"static friction {static} of {look.GetPath()}: {dynamic}, the dynamic one, counts"
        if line not in reader.said:
            reader.said.append(line)
    return static if dynamic is None else dynamic
