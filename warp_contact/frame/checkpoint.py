"""A run on disk: what a simulation of the same scene needs to continue with the same bits."""

import hashlib
import json
import os
from pathlib import Path

import numpy as np
from numpy.lib.recfunctions import repack_fields

from warp_contact.data.model import Model
from warp_contact.files import replacing

FORMAT = 13


def fingerprint(model: Model, first: tuple, **settings) -> str:
    """All that must be the same for a run to continue with the same bits, as JSON.

    A digest of the scene, with its ``first`` surroundings, and the settings by their names.
    """
    digest = hashlib.sha256(repr(first).encode())
    arrays = [model.body_vert, model.body_world, model.tets, model.mass, model.inv_mass]
    arrays += [model.plane_n, model.plane_h]
    for elements in model.elements:
        digest.update(elements.kernels.__name__.encode())
        arrays += [elements.tet, elements.param]
    digest.update(model.rest.tobytes())
    if model.ties:
        digest.update(repr(model.ties.labels).encode())
        for array in (a for a in vars(model.ties).values() if isinstance(a, np.ndarray)):
            digest.update(array.tobytes())
    for solid in filter(None, model.solids):
        digest.update(np.array([solid.mass, *solid.centre, *solid.inertia.ravel()]).tobytes())
    for array in arrays:
        digest.update(array.numpy().tobytes())
    named = {name: str(value) for name, value in settings.items()}
    return json.dumps({"format": FORMAT, "scene": digest.hexdigest()} | named)


def write(path: str | os.PathLike, scene: str, values: dict[str, np.ndarray]) -> None:
    """Write ``values`` as ``.npz`` under the fingerprint ``scene``; the file appears complete."""
    with replacing(Path(path)) as part, part.open("wb") as file:
        np.savez(file, scene=np.array(scene), digest=np.array(_digest(values)), **values)


def read(path: str | os.PathLike, scene: str) -> dict[str, np.ndarray]:
    """The values of a file.

    Raises:
        OSError: it cannot be read
        ValueError: it is no checkpoint, one of another scene or other settings, or damaged
    """
    try:
        with Path(path).open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            values = dict(file)
    except OSError:
        raise
    except Exception as error:  # what a damaged archive leads to has no common name
        raise ValueError(f"{path} is no checkpoint, or damaged") from error
    _refuse_other(str(values.pop("scene", "")), scene, path)
    if str(values.pop("digest", "")) != _digest(values):
        raise ValueError(f"{path} is damaged: it is not what was written")
    return values


def _refuse_other(written: str, scene: str, path: str | os.PathLike) -> None:
    """Raise ValueError, with what differs, where two fingerprints do."""
    try:
        old, now = json.loads(written), json.loads(scene)
        other = [name for name in now if old[name] != now[name]]
    except (ValueError, LookupError, TypeError):
        other = ["format"]
    if "format" in other:
        raise ValueError(f"{path} is of another version of the simulation")
    if "scene" in other:
        raise ValueError(f"{path} is of another scene")
    if other:
        was = ", ".join(f"{name}={old[name]}, not {now[name]}" for name in other)
        raise ValueError(f"{path} is of other settings: {was}")


def ungroup(groups: dict[str, dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """The values of groups in one dictionary, called ``name.something``."""
    return {f"{name}.{k}": value for name, values in groups.items() for k, value in values.items()}


def _digest(values: dict[str, np.ndarray]) -> str:
    """Digest of names, types, shapes and values."""
    digest = hashlib.sha256()
    for name, value in sorted(values.items()):
        value = repack_fields(value)  # what lies between fields has no value
        digest.update(repr((name, value.dtype.descr, value.shape)).encode())
        digest.update(value.tobytes())
    return digest.hexdigest()


def group(values: dict[str, np.ndarray], name: str) -> dict[str, np.ndarray]:
    """The values called ``name.something``, by something."""
    return {k.removeprefix(f"{name}."): v for k, v in values.items() if k.startswith(f"{name}.")}
