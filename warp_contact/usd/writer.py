"""USD output that survives the end of its process.

    <dir>/<name>.usda           root: metadata and the clip range, renewed after each frame
    <dir>/topology.usdc         prims, faces, tets, materials: once
    <dir>/manifest.usdc         which attributes the frames carry: once
    <dir>/frames/f.000012.usdc  what changes: one file a frame

Each file is written under another name and renamed, a frame before the root counts it. So at any
moment the root names finished frames only, and all of them. The files appear, or take the place of
those of an earlier run, together with the first frame. They are put on the disk about once a second
and at the end: only the power of the machine can take what was not.

Of a rigid body the prim moves, and its points are written once, in the frame of its mesh.

Each surface carries ``primvars:contact:pressure`` [Pa], ``penetration`` [m] and ``partner``: the
index of the other body, n_body + p for half-space p, -1 for none. Pressure and penetration are
rounded to a thousandth of their largest value on the body, to a 250th on those of 1000 points or
some more, so that they pack to half the size. Colours are indices into a palette.
"""

import os
from pathlib import Path

import numpy as np
from pxr import Sdf, Tf, UsdGeom, Vt

from warp_contact.files import renew, replacing, sync_all
from warp_contact.usd.attachments import Attachments
from warp_contact.usd.contacts import ContactArrows
from warp_contact.usd.fields import field_types, field_values, hydrostatic
from warp_contact.usd.folder import (
    ROOT,
    SYNC_EVERY,
    TOPOLOGY,
    RunFolder,
    frame_file,
    frame_files,
    frame_names,
)
from warp_contact.usd.kept import check_frames, check_layers, first_frame
from warp_contact.usd.motion import motion, motion_types, numbers, velocities, velocity_types
from warp_contact.usd.prims import check_options, parts, shades, topology
from warp_contact.usd.reader import open_stage
from warp_contact.usd.skin import add_renders, copy_textures, render_types, render_values, renders


class UsdWriter:
    """Writes one frame of ``sim`` at each ``write()``; a context manager.

    It owns the folder until it is closed: another writer there is refused, in any process.

    Attributes:
        start: the first frame written, None before it
        end: the last one
        notes: those of the frames that were there when it was resumed
    """

    start: int | None
    end: int | None
    notes: list[str]

    def __init__(
        self,
        path,
        sim,
        velocities: bool = False,
        tets: bool = True,
        flatten: bool = False,
        *,
        animate_tets: bool = False,
        contacts: bool | float = False,
        view: tuple | None = None,
        pressure_scale: float | None = None,
        overwrite: bool = False,
        resume: bool = False,
    ):
        """Start a file, or resume an earlier one.

        Args:
            path: a directory, whose name the root layer takes, or the ``.usda`` root layer itself;
                or a ``RunFolder``, which is closed with the writer
            sim: the simulation; its model, positions and contact fields are what is written
            velocities: write velocities too [m/s], those of surfaces, and of tets that are animated
            tets: write each body's TetMesh, purpose guide, and the attachments
            flatten: ``close()`` also writes everything into one ``<name>.usdc``
            animate_tets: time-sample the points of the TetMeshes, inner vertices included
            contacts: write points and arrows of contact forces; a number is their length [m/N]
            view: eye and target [m] of a camera to write
            pressure_scale: pressure [Pa] drawn as fully hot; None takes twice the hydrostatic
                pressure over the scene's size, or without gravity the highest pressure so far
            overwrite: replace what is there, when the first frame is written
            resume: keep the frames up to ``sim.frame`` of an earlier run with the same arguments

        Raises:
            OSError: something is there, or another writer at work; it cannot be written to
            ValueError: the path cannot be that of a root layer; what is to be resumed is damaged
        """
        check_options(sim, view, pressure_scale, (velocities, tets, flatten, animate_tets, resume))
        self.arrows = ContactArrows(sim, contacts) if contacts is not False else None
        self.folder = _folder(path, overwrite, resume)
        self.sim, self.velocities, self.flatten = sim, velocities, flatten
        self.animate_tets = animate_tets and tets
        self.parts, self.start, self.end, self.notes = parts(sim.model), None, None, []
        self.attachments = Attachments(self.parts, sim.scene.attachments if tets else ())
        self.scale = hydrostatic(sim) if pressure_scale is None else pressure_scale
        self._begin(topology(self.parts, sim, tets, view), resume)

    def _begin(self, prims: Sdf.Layer, resume: bool) -> None:
        """Write what does not change."""
        try:
            self.renders = renders(self.parts, self.sim)
            self.grows, self.types = self.scale == 0.0, self._types()
            self.layer, self.paths = self._declare(), [Sdf.Path(path) for path in self.types]
            if self.arrows:
                self.arrows.define(prims)
            self.attachments.define(prims)
            if resume:
                self._check()
            copy_textures(self.renders, self.folder.now)
            add_renders(prims, self.renders)
            export(prims, self.folder.now / TOPOLOGY)
            export(self.layer, self.folder.now / "manifest.usdc")
            if resume:
                self._cut()
        except BaseException:
            self.folder.close()
            raise

    @property
    def root(self) -> Path:
        """The root layer."""
        return self.folder.root

    def __enter__(self):
        """Return the writer."""
        return self

    def __exit__(self, kind, *_):
        """Close; after an error what was written stays and nothing is flattened."""
        if kind is None:
            self.close()
        else:
            self.folder.close()

    def write(self, note: str = "", publish: bool = True) -> None:
        """Write the state of the simulation as frame ``sim.frame``, and ``note`` in its file.

        Without ``publish`` what was there before stays in its place until a later frame.
        """
        frame = self.sim.frame
        if not self.folder.is_open:
            raise ValueError(f"{self.root} is closed: no frame can be written any more")
        if self.end is not None and frame != self.end + 1:
            raise ValueError(f"frame {frame} cannot follow frame {self.end}")
        for path, value in zip(self.paths, list(self._values()), strict=True):
            if self.end is not None:
                self.layer.EraseTimeSample(path, self.end)
            self.layer.SetTimeSample(path, frame, value)
        lengths = {"forceScale": self.arrows.scale} if self.arrows else {}
        self.layer.customLayerData = {"pressureScale": self.scale, "note": note} | lengths
        start = frame if self.start is None else self.start
        self.folder.wrote(self._write_frame(frame), self._write_root(start, frame))
        if publish:
            self.folder.publish()
        self.folder.sync(SYNC_EVERY)
        self.start, self.end = start, frame

    def sync(self) -> None:
        """Put all frames on the disk now, as before a checkpoint that counts on them."""
        self.folder.sync()

    def close(self) -> None:
        """Put all on the disk, flatten, if asked to, and let others have the folder."""
        try:
            if self.folder.is_open:
                self.folder.sync()
            if self.flatten and self.end is not None and self.folder.is_open:
                export(open_stage(self.root).Flatten(), self.root.with_suffix(".usdc"))
        finally:
            self.folder.close()

    def _check(self) -> None:
        """See that the earlier file, up to the frame of the simulation, is what it should be."""
        self.start, self.end = first_frame(self.root), self.sim.frame
        check_layers(self.root, self.layer, list(self.sim.model.labels))
        values = zip(self.types, self._values(), strict=True)
        lengths = {path: len(numbers(value)) for path, value in values}
        if self.arrows:
            lengths |= dict.fromkeys(self.arrows.types())  # any number of contacts
        kept = check_frames(self.root.parent, range(self.start, self.end + 1), lengths)
        if not kept:
            raise ValueError(f"{self.root} begins at frame {self.start}, after {self.end}")
        self.scale = kept[-1].get("pressureScale", self.scale)
        if self.arrows:
            self.arrows.scale = kept[-1].get("forceScale", self.arrows.scale)
        self.notes = [data.get("note", "") for data in kept]

    def _cut(self) -> None:
        """Make the earlier file end at the frame of the simulation."""
        self._write_root(self.start, self.end)
        sync_all((self.root, self.root.parent))
        self.root.with_suffix(".usdc").unlink(missing_ok=True)
        for path in frame_files(self.root.parent):
            if path > frame_file(self.root.parent, self.end):
                path.unlink()

    def _values(self):
        """The values of the attributes of this frame, in the order of ``_types``."""
        x = np.ascontiguousarray(self.sim.positions(), dtype=np.float32)
        v = np.asarray(self.sim.velocities(), dtype=np.float32) if self.velocities else None
        fields = self.sim.contact_fields()
        if self.grows:
            self.scale = max(self.scale, float(fields["pressure"].max(initial=0.0)))
        shade = shades(fields["pressure"] / (self.scale or 1.0))
        for part in self.parts:
            yield from motion(part, self.sim, x)
            yield from field_values(part, shade, fields)
            if v is not None:
                yield from velocities(part, self.sim, x, v, self.animate_tets)
            if self.animate_tets and not part.is_rigid:
                points = Vt.Vec3fArray.FromNumpy(x[slice(*part.verts)])
                yield from (points, UsdGeom.PointBased.ComputeExtent(points))
        for render in self.renders:
            yield from render_values(render, self.sim)
        yield from self.attachments.values(self.sim)
        if self.arrows:
            yield from self.arrows.values(self.sim)

    def _types(self) -> dict[str, Sdf.ValueTypeName]:
        """The attributes of a frame, by their paths."""
        types, attributes = Sdf.ValueTypeNames, dict[str, Sdf.ValueTypeName]()
        for part in self.parts:
            attributes |= motion_types(part) | field_types(part)
            if self.velocities:
                attributes |= velocity_types(part, self.sim.model, self.animate_tets)
            if self.animate_tets and not part.is_rigid:
                attributes[f"{part.path}/sim.points"] = types.Point3fArray
                attributes[f"{part.path}/sim.extent"] = types.Float3Array
        for render in self.renders:
            attributes |= render_types(render)
        attributes |= self.attachments.types()
        return attributes | (self.arrows.types() if self.arrows else {})

    def _declare(self) -> Sdf.Layer:
        """A layer that holds every attribute of a frame, without values."""
        layer = Sdf.Layer.CreateAnonymous(".usdc")
        layer.timeCodesPerSecond = layer.framesPerSecond = self.sim.fps
        for path, kind in self.types.items():
            prim, _, name = path.partition(".")
            Sdf.AttributeSpec(Sdf.CreatePrimInLayer(layer, prim), name, kind)
        return layer

    def _write_frame(self, frame: int) -> str:
        """Write the layer as the file of a frame, which is named."""
        part, path = frame_names(self.folder.now, frame)
        try:
            save(self.layer, part, path)
            os.replace(part, path)
        except BaseException:
            Path(part).unlink(missing_ok=True)
            raise
        return path

    def _write_root(self, start: int, end: int) -> str:
        """Make the root layer, which is named, tell of the frames."""
        path = f"{self.folder.now}/{self.folder.root.name}"
        renew(path, ROOT.format(start=start, end=end, fps=self.sim.fps))
        return path


def export(layer: Sdf.Layer, path: Path) -> None:
    """Write a layer so that ``path`` is either absent, old or complete."""
    with replacing(path) as part:
        save(layer, str(part), path)


def save(layer: Sdf.Layer, part: str, path: Path | str) -> None:
    """Write a layer as ``part``, which may be cut short where the OSError names ``path``."""
    try:
        is_written, reason = layer.Export(part), "USD does not say why"
    except Tf.ErrorException as error:  # each of its lines ends with : 'what went wrong'
        first = str(error).strip().partition("\n")[0]
        is_written, reason = False, first.split(" : ")[-1].strip("'")
    if not is_written:
        raise OSError(f"cannot write {path}: {reason}")


def _folder(path, overwrite: bool, resume: bool) -> RunFolder:
    """The folder of a path, unless it is one."""
    return path if isinstance(path, RunFolder) else RunFolder(path, overwrite, resume)
