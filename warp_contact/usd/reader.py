"""Reads the stages that a ``UsdWriter`` writes."""

import os
import re
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Tf, Usd, UsdGeom

from warp_contact import checks
from warp_contact.files import HIDDEN

FRAMES = 1_000_000  # numbers of frames are below: they have six digits


@dataclass(frozen=True)
class Body:
    """A body as it is read.

    Attributes:
        label: its name
        mesh: its surface
        sim: its tets, None if not written
        fixed: whether none of its vertices moves freely
        rigid: whether its prim moves, and not its points
    """

    label: str
    mesh: UsdGeom.Mesh
    sim: UsdGeom.TetMesh | None
    fixed: bool
    rigid: bool


def root_path(path) -> Path:
    """The root layer that ``path``, a directory or a ``.usda`` file, stands for.

    Raises:
        ValueError: it is empty, of another kind, or has a name that USD cannot open
    """
    path = checks.path(path, "path").resolve()
    reason = unusable(path)
    if reason:
        raise ValueError(f"{str(path)!r}: {reason}")
    if path.suffix == ".usda":
        return path
    if path.suffix.startswith(".usd") or path.is_file():
        raise ValueError(f"{path.name}: give a directory or the path of a .usda file")
    return path / f"{path.name or 'simulation'}.usda"


def unusable(path: Path) -> str | None:
    """What USD does not take in the name of a file or its folders, if anything."""
    name = str(path)
    if any(unicodedata.category(c) in ("Cc", "Cs") for c in name):
        return "USD opens no file with a control character, or what is no UTF-8, in its name"
    for part in ("\\", ":SDF_FORMAT_ARGS:"):
        if part in name and os.sep != part:
            return f"USD opens no file with {part} in its name"
    return None


def open_stage(path) -> Usd.Stage:
    """The stage at ``path``: a directory that a ``UsdWriter`` filled, or a USD file."""
    path = Path(path)
    if path.is_dir():
        path = root_path(path) if root_path(path).exists() else only_root(path)
    if not path.exists():
        raise FileNotFoundError(f"no such file: {path}")
    reason = unusable(path.resolve())
    if reason:
        raise OSError(f"{str(path)!r}: {reason}")
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise OSError(f"{path} is not a readable USD file") from error
    stage.Reload()  # a layer that is still open from before may be out of date
    return stage


def only_root(directory: Path) -> Path:
    """The one root layer in a directory."""
    roots = roots_in(directory)
    if len(roots) != 1:
        raise FileNotFoundError(f"{directory} holds {len(roots) or 'no'} .usda files, not one")
    return roots[0]


def roots_in(directory: Path) -> list[Path]:
    """All ``.usda`` files of a directory that are finished."""
    return sorted(p for p in directory.glob("*.usda") if not p.name.startswith(HIDDEN))


def frame_numbers(stage: Usd.Stage) -> range:
    """The frames of a stage; raises ValueError where they make no sense."""
    first, last = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    if not (abs(first) < FRAMES and abs(last) < FRAMES and first <= last):
        name = stage.GetRootLayer().GetDisplayName()
        raise ValueError(
            f"{name} says that its frames go from {first:g} to {last:g}: "
            f"correct its startTimeCode and endTimeCode"
        )
    return range(round(first), round(last) + 1)


def frame_rate(stage: Usd.Stage) -> float:
    """Frames a second; raises ValueError where that is not above zero."""
    rate = stage.GetTimeCodesPerSecond()
    if not (rate > 0.0 and np.isfinite(rate)):
        name = stage.GetRootLayer().GetDisplayName()
        raise ValueError(f"{name} says {rate:g} frames a second: correct its timeCodesPerSecond")
    return rate


@contextmanager
def usd_errors(path) -> Iterator[None]:
    """Errors that USD raises within become one OSError that names the file."""
    try:
        yield
    except Tf.ErrorException as error:
        raise OSError(f"{path} is not a readable USD file ({in_short(error)})") from error


def in_short(error: Exception) -> str:
    """The essence of an error in one line; USD quotes it among much else."""
    said = re.findall(r" : '(.*?)'\s*(?:\n|$)", str(error), re.DOTALL)
    text = re.sub(r"pxrInternal\w*::", "", (said or [str(error)])[0])
    return " ".join(text.split())[:300]


def place(prim: Usd.Prim) -> str:
    """File and path of a prim."""
    return f"{prim.GetStage().GetRootLayer().GetDisplayName()}: {prim.GetPath()}"


def read_bodies(stage: Usd.Stage) -> list[Body]:
    """The bodies of a stage in the order of their indices; raises ValueError for half a body."""
    found = []
    for prim in stage.GetDefaultPrim().GetChildren() if stage.GetDefaultPrim() else ():
        index, label = read_note(prim, "body"), read_note(prim, "label")
        if index is None:
            continue
        surface, sim = prim.GetChild(prim.GetName()), prim.GetChild("sim")
        if not isinstance(index, int) or not isinstance(label, str) or not surface:
            raise ValueError(f"{place(prim)} lacks the number, label or surface of a body")
        body = Body(
            label=label,
            mesh=UsdGeom.Mesh(surface),
            sim=UsdGeom.TetMesh(sim) if sim else None,
            fixed=bool(read_note(prim, "fixed")),
            rigid=bool(UsdGeom.Xformable(prim).GetOrderedXformOps()),
        )
        found.append((index, body))
    return [body for _, body in sorted(found, key=lambda pair: pair[0])]


def read_points(stage: Usd.Stage, frame: int) -> dict[str, np.ndarray]:
    """Surface points [m] of each body at a frame by its label, float32 (n, 3), in the world."""
    return {body.label: world_points(body.mesh, frame) for body in read_bodies(stage)}


def world_points(mesh: UsdGeom.Mesh, frame: float) -> np.ndarray:
    """The points of a mesh [m] in world coordinates, float32 (n, 3); none where it has none."""
    points = np.asarray(mesh.GetPointsAttr().Get(frame) or np.zeros((0, 3)), dtype=np.float32)
    matrix = np.asarray(mesh.ComputeLocalToWorldTransform(frame))  # acts on row vectors
    if (matrix == np.eye(4)).all():
        return points
    return (points @ matrix[:3, :3] + matrix[3, :3]).astype(np.float32)


def read_planes(stage: Usd.Stage) -> list[tuple[np.ndarray, float]]:
    """Normal and offset [m] of each half-space; raises ValueError for one without direction."""
    found = []
    for prim in stage.GetDefaultPrim().GetChildren() if stage.GetDefaultPrim() else ():
        n, h = read_note(prim, "normal"), read_note(prim, "offset")
        if n is not None and h is not None:
            n = checks.numbers(n, (3,), f"normal of {place(prim)}")
            if not n.any():
                raise ValueError(f"the normal of {place(prim)} is zero")
            found.append((n, checks.number(h, f"offset of {place(prim)}")))
    return found


def read_view(stage: Usd.Stage) -> tuple[np.ndarray, np.ndarray] | None:
    """Eye and target [m] of the camera, if there is one."""
    root = stage.GetDefaultPrim()
    prim = root.GetChild("view") if root else None
    if not prim:
        return None
    eye, target = read_note(prim, "eye"), read_note(prim, "target")
    return None if eye is None or target is None else (np.array(eye), np.array(target))


def read_note(prim: Usd.Prim, name: str):
    """A constant under ``userProperties``, None if it is not there."""
    return prim.GetAttribute(f"userProperties:{name}").Get()
