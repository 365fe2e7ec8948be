"""A scene from a USD stage: of the numbers that ``reading_scene.py`` finds bodies are made."""

import io
import json
import warnings
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from warp_contact import checks
from warp_contact.scene import attachments, files
from warp_contact.scene.materials import Corotated, NeoHookean, Rigid, SpringNetwork
from warp_contact.scene.mesh import MeshError, TetMesh
from warp_contact.scene.pose import quaternion
from warp_contact.scene.topology import HUGE

WATER = 1000.0  # density [kg/m^3] where a stage gives none, as UsdPhysics says
SAME = 1e-5  # by which rounding may change what a density and a shape weigh
SOLIDS = {"NeoHookean": NeoHookean, "Corotated": Corotated}


def fill(scene, path, at, material) -> None:
    """Add to an empty scene what is in a stage; as ``Scene.from_usd``."""
    root = root_of(path)
    if not isinstance(at, str) or at not in ("start", "last"):
        at = checks.number(at, "at, which may be 'start' or 'last' too,", -1e6, 1e6)
    beside = [root, *root.parent.glob("*.usdc"), *root.parent.glob("frames/*.usdc")]
    size = sum(file.stat().st_size for file in beside if file.is_file())
    answer = io.BytesIO(files.in_child("scene", root, str(at), size))
    with np.load(answer, allow_pickle=False) as archive:
        arrays = dict(archive)
    found = json.loads(str(arrays.pop("scene")))
    scene.gravity = found["gravity"]
    for name in ("friction", "restitution"):
        if found[name] is not None:
            setattr(scene, name, found[name])
    said = found["not_read"]
    for k, info in enumerate(found["bodies"]):
        own = {n.partition(".")[2]: a for n, a in arrays.items() if n.startswith(f"{k}.")}
        try:
            add_body(scene, info, own, material, said)
        except ValueError as error:
            raise MeshError(f"{root}: {info['path']}: {error}") from None
    for info in found["attachments"]:
        try:
            add_attachment(scene, info, arrays)
        except ValueError as error:
            said.append(f"{info['path']}: {error}")
    for plane in found["planes"]:
        given = plane["normal"], plane["offset"], plane["friction"], plane["restitution"]
        scene.add_plane(*given)
    scene.not_read = [*said, *found["only_seen"]]
    if said:
        more = f" and {len(said) - 1} more, see scene.not_read" if len(said) > 1 else ""
        warnings.warn(f"{root}: not read or assumed: {said[0]}{more}", stacklevel=3)


def root_of(path) -> Path:
    """The file of a stage: that at the path, or the one ``.usda`` in a folder."""
    path = checks.path(path, "path")
    if path.is_dir():
        roots = sorted(p for p in path.glob("*.usda") if not p.name.startswith("."))
        if len(roots) != 1:
            raise FileNotFoundError(f"{path} holds {len(roots) or 'no'} .usda files, not one")
        path = roots[0]
    path = files.regular(path)
    if path.suffix.lower() not in files.USD:
        raise checks.refuse("path", str(path), f"a USD file: {', '.join(files.USD)}")
    return path


def add_body(scene, info: dict, arrays: dict, material, said: list[str]) -> None:
    """Add a body as it was read."""
    mesh = TetMesh(arrays["vertices"], arrays["tets"])
    chosen = (rigid_of if info["rigid"] else solid_of)(info, mesh, material, said)
    place = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
    if info["rigid"]:
        place = info["position"], quaternion(np.array(info["rotation"]))
    body = scene.add_body(
        mesh,
        chosen,
        *place,
        velocity=velocity_of(info, arrays, chosen, mesh),
        fixed=True if info["fixed"] else arrays.get("held"),
        label=label_of(scene, info),
        world=info["world"],
        friction=info["friction"],
        restitution=info["restitution"],
    )
    if "start" in arrays:
        start = checks.numbers(arrays["start"], body.x.shape, "points", HUGE)
        scene.bodies[-1] = replace(body, start=start)


def add_attachment(scene, info: dict, arrays: dict) -> None:
    """Add an attachment as it was read, of bodies that are there.

    Raises:
        ValueError: it holds nothing
    """
    taken = {other.label for other in scene.attachments}
    label = info["label"][: checks.LONGEST - 10]
    free = (f"{label}_{n}" if n else label for n in range(len(taken) + 1))
    given = {"label": next(name for name in free if name not in taken)}
    given |= {key: info[key] for key in ("kind", "stiffness", "breaking_force")}
    if "at" in info:
        scene.attach(info["a"], info["b"], at=info["at"], axis=info["axis"], **given)
        return
    k, sites = len(scene.attachments), []
    for which, site in (info["a"], info["first"]), (info["b"], info["second"]):
        body = None if which is None else scene.bodies[which]
        sites.append(body and attachments.site_of(body, site, arrays[f"{which}.tets"]))
    a, b = (None if info[side] is None else scene.bodies[info[side]] for side in "ab")
    n = len(sites[0][0])
    points = checks.numbers(info["second"].get("points", np.zeros((n, 3))), (n, 3), "points", HUGE)
    line = np.zeros(3) if info["axis"] is None else checks.numbers(info["axis"], (3,), "axis")
    made = attachments.hold(k, a=a, b=b, sites=(*sites, points), line=line, **given)
    scene.attachments.append(made)


def label_of(scene, info: dict) -> str:
    """A label that no other body has, and no plane."""
    label = info["label"][: checks.LONGEST - 10]
    for n in range(len(scene.bodies) + 2):
        with suppress(ValueError):
            return scene.new_label(f"{label}_{n}" if n else label)
    return scene.new_label(label)  # says why not


def solid_of(info: dict, mesh: TetMesh, material, said: list[str]):
    """The material of a body that deforms."""
    density = density_of(info, mesh, said)
    damping = info["damping"] or 0.0
    if info["model"] == "SpringNetwork":
        springs = {name: info[name] for name in ("distance", "area", "volume")}
        return SpringNetwork(**springs, density=density, damping=damping)
    elastic = info["youngs_modulus"], info["poisson_ratio"]
    if None not in elastic:
        if info["model"] not in (None, *SOLIDS):
            said.append(f"material {info['model']} of {info['path']}: taken as NeoHookean")
        return SOLIDS.get(info["model"], NeoHookean)(*elastic, density, damping)
    if material is None:
        lacks = "no youngsModulus" if elastic[0] is None else "no poissonsRatio"
        raise ValueError(f"has {lacks}: give material=wc.NeoHookean(...) for such bodies")
    return material


def density_of(info: dict, mesh: TetMesh, said: list[str]) -> float:
    """Density [kg/m^3]: of a mass that is given, else the one that is, else that of water."""
    if info["mass"] is not None:
        return info["mass"] / mesh.volume
    if info["density"] is None:
        said.append(f"no density of {info['path']}: taken as {WATER:g} kg/m^3")
        return WATER
    return info["density"]


def rigid_of(info: dict, mesh: TetMesh, _, said: list[str]) -> Rigid:
    """The material of a rigid body: what a stage does not give is that of its shape."""
    density = info["density"] or density_of(info, mesh, said)
    full = Rigid(density).solid(mesh.vertices, mesh.tets)
    mass = info["mass"] or full.mass
    centre = np.array(info.get("centre", full.centre), dtype=float)
    d = centre - full.centre
    away = mass * (d @ d * np.eye(3) - np.outer(d, d))  # Steiner
    inertia = np.array(info["inertia"] or mass / full.mass * full.inertia + away)
    near = [(mass, full.mass, full.mass), (inertia, full.inertia, np.trace(full.inertia))]
    near.append((centre, full.centre, np.ptp(mesh.vertices)))
    if all(np.abs(a - b).max() <= SAME * size for a, b, size in near):
        return Rigid(density)
    return Rigid(mass=mass, centre=centre, inertia=inertia)


def velocity_of(info: dict, arrays: dict, material, mesh: TetMesh) -> np.ndarray:
    """Velocities [m/s], of each vertex of a body that deforms or turns."""
    if not info["rigid"]:
        return arrays.get("v", np.zeros(3))
    v, w = (np.array(info[name] or (0.0, 0.0, 0.0)) for name in ("velocity", "angularVelocity"))
    arms = mesh.vertices - material.solid(mesh.vertices, mesh.tets).centre
    return v + np.cross(w, arms @ np.array(info["rotation"]).T)
