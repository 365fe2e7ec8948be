"""Reads the stages that a ``UsdWriter`` writes."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Tf, Usd, UsdGeom

from warp_contact import checks


@dataclass(frozen=True)
class Body:
    """A body as it is read: ``mesh`` is its surface, ``sim`` its tets (None if not written)."""

    label: str
    mesh: UsdGeom.Mesh
    sim: UsdGeom.TetMesh | None
    fixed: bool


def root_path(path) -> Path:
    """The root layer that ``path``, a directory or a ``.usda`` file, stands for."""
    path = checks.path(path, "path").resolve()
    if path.suffix == ".usda":
        return path
    if path.suffix.startswith(".usd") or path.is_file():
        raise ValueError(f"{path.name}: give a directory or the path of a .usda file")
    return path / f"{path.name or 'simulation'}.usda"


def open_stage(path) -> Usd.Stage:
    """The stage at ``path``: a directory that a ``UsdWriter`` filled, or a USD file."""
    path = Path(path)
    if path.is_dir():
        path = root_path(path) if root_path(path).exists() else only_root(path)
    if not path.exists():
        raise FileNotFoundError(f"no such file: {path}")
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise OSError(f"{path} is not a readable USD file") from error
    stage.Reload()  # a layer that is still open from before may be out of date
    return stage


def only_root(directory: Path) -> Path:
    """The one root layer in a directory."""
    roots = sorted(directory.glob("*.usda"))
    if len(roots) != 1:
        raise FileNotFoundError(f"{directory} holds {len(roots) or 'no'} .usda files, not one")
    return roots[0]


def frame_numbers(stage: Usd.Stage) -> range:
    """The frames of a stage."""
    return range(round(stage.GetStartTimeCode()), round(stage.GetEndTimeCode()) + 1)


def read_bodies(stage: Usd.Stage) -> list[Body]:
    """The bodies of a stage in the order of their indices."""
    found = []
    for prim in stage.GetDefaultPrim().GetChildren():
        index = read_note(prim, "body")
        if index is None:
            continue
        sim = prim.GetChild("sim")
        body = Body(
            label=read_note(prim, "label"),
            mesh=UsdGeom.Mesh(prim.GetChild("surface")),
            sim=UsdGeom.TetMesh(sim) if sim else None,
            fixed=bool(read_note(prim, "fixed")),
        )
        found.append((index, body))
    return [body for _, body in sorted(found, key=lambda pair: pair[0])]


def read_points(stage: Usd.Stage, frame: int) -> dict[str, np.ndarray]:
    """Surface points [m] of each body at a frame by its label, shape (n, 3)."""
    bodies = read_bodies(stage)
    return {body.label: np.asarray(body.mesh.GetPointsAttr().Get(frame)) for body in bodies}


def read_planes(stage: Usd.Stage) -> list[tuple[np.ndarray, float]]:
    """Normal and offset [m] of each half-space."""
    prims = stage.GetDefaultPrim().GetChildren()
    pairs = [(read_note(prim, "normal"), read_note(prim, "offset")) for prim in prims]
    return [(np.array(n), h) for n, h in pairs if n is not None and h is not None]


def read_view(stage: Usd.Stage) -> tuple[np.ndarray, np.ndarray] | None:
    """Eye and target [m] of the camera, if there is one."""
    prim = stage.GetDefaultPrim().GetChild("view")
    if not prim:
        return None
    eye, target = read_note(prim, "eye"), read_note(prim, "target")
    return None if eye is None or target is None else (np.array(eye), np.array(target))


def read_note(prim: Usd.Prim, name: str):
    """A constant under ``userProperties``, None if it is not there."""
    return prim.GetAttribute(f"userProperties:{name}").Get()
