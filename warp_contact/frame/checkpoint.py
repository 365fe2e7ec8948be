"""A run on disk: what a simulation of the same scene needs to continue with the same bits."""

import hashlib
import os
import zipfile
from pathlib import Path

import numpy as np

from warp_contact.data.model import Model

FORMAT = 4


def fingerprint(model: Model, *settings) -> str:
    """Digest of all that must be the same for a run to continue with the same bits."""
    digest = hashlib.sha256(repr((FORMAT, model.gravity, model.friction, settings)).encode())
    arrays = [model.body_vert, model.body_world, model.tets, model.pose, model.mass, model.inv_mass]
    arrays += [model.plane_n, model.plane_h]
    for elements in model.elements:
        digest.update(elements.kernels.__name__.encode())
        arrays += [elements.tet, elements.param]
    for array in arrays:
        digest.update(array.numpy().tobytes())
    return digest.hexdigest()


def write(path: str | os.PathLike, scene: str, values: dict[str, np.ndarray]) -> None:
    """Write ``values`` as ``.npz`` under the fingerprint ``scene``; the file appears complete."""
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as file:
            np.savez(file, scene=np.array(scene), **values)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def read(path: str | os.PathLike, scene: str) -> dict[str, np.ndarray]:
    """The values of a file.

    Raises:
        OSError: it cannot be read
        ValueError: it is no checkpoint, or one of another scene or other settings
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            values = dict(file)
    except (ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path} is no checkpoint") from error
    if str(values.pop("scene", "")) != scene:
        what = "another scene, or of other settings or another version of the simulation"
        raise ValueError(f"{path} is of {what}")
    return values


def ungroup(groups: dict[str, dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """The values of groups in one dictionary, called ``name.something``."""
    return {f"{name}.{k}": value for name, values in groups.items() for k, value in values.items()}


def group(values: dict[str, np.ndarray], name: str) -> dict[str, np.ndarray]:
    """The values called ``name.something``, by something."""
    return {k.removeprefix(f"{name}."): v for k, v in values.items() if k.startswith(f"{name}.")}
