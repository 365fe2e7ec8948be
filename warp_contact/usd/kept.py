"""What of an earlier run is kept when it is resumed, and whether it is what it should be."""

from pathlib import Path

import numpy as np
from pxr import Sdf, Tf, Usd

from warp_contact.usd.folder import TOPOLOGY, frame_file, frame_files, has_run
from warp_contact.usd.motion import numbers
from warp_contact.usd.reader import read_bodies


def first_frame(root: Path) -> int:
    """The first frame of a run: that which its root layer names, or else the first file."""
    layer, files = read_layer(root), frame_files(root.parent)
    if layer is not None and not has_run(root):
        raise ValueError(f"{root} is not the root layer of a run")
    if layer is not None and layer.HasStartTimeCode():
        return round(layer.startTimeCode)
    if not files:
        raise ValueError(f"{root.parent} has no frames")
    return int(files[0].name.split(".")[1])


def check_layers(root: Path, manifest: Sdf.Layer, labels: list[str]) -> None:
    """Refuse to go on with a run of other bodies or attributes.

    What is lost or damaged of the layers themselves is no matter: they are written anew.

    Raises:
        ValueError: it is of other bodies, or was written with other arguments
    """
    declared = read_layer(root.parent / "manifest.usdc")
    topology = read_layer(root.parent / TOPOLOGY)
    if declared is not None and declared.ExportToString() != manifest.ExportToString():
        raise ValueError(f"{root} has other bodies, or was written with other arguments")
    if topology is not None and topology.defaultPrim:
        found = [body.label for body in read_bodies(Usd.Stage.Open(topology))]
        if found and found != labels:
            raise ValueError(f"{root} has other bodies: {', '.join(found)}")


def check_frames(folder: Path, frames: range, lengths: dict[str, int | None]) -> list[dict]:
    """See that each frame has its values; return the notes of each.

    ``lengths`` are their numbers by path, None for any number.

    Raises:
        ValueError: one is missing, damaged, or another one
    """
    notes = []
    for frame in frames:
        path = frame_file(folder, frame)
        if not path.is_file():
            raise ValueError(f"frame {frame} is missing: no file {path}")
        layer = read_layer(path)
        if layer is None:
            raise ValueError(f"{path} is damaged: USD cannot read it")
        for name, n in lengths.items():
            times = layer.ListTimeSamplesForPath(name)
            if times != [float(frame)]:
                raise ValueError(f"{path} is not frame {frame}: {name} has values at {times}")
            value = layer.QueryTimeSample(name, frame)
            found = np.zeros(0) if value is None else numbers(value)
            n = len(found) if n is None and value is not None else n
            if len(found) != n or not np.isfinite(found).all():
                raise ValueError(f"{path} is damaged: {name} has not {n} finite values")
        notes.append(layer.customLayerData)
    return notes


def read_layer(path: Path) -> Sdf.Layer | None:
    """A layer as it is on disk, None if it cannot be read."""
    try:
        return Sdf.Layer.OpenAsAnonymous(str(path))
    except Tf.ErrorException:
        return None
