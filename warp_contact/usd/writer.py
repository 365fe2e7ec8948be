"""USD output that survives the end of its process.

    <dir>/<name>.usda           root: metadata and the clip range, rewritten after each frame
    <dir>/topology.usdc         prims, faces, tets, materials: once
    <dir>/manifest.usdc         which attributes the frames carry: once
    <dir>/frames/f.000012.usdc  what changes: one file a frame

Each file is written under another name and then renamed, a frame before the root that counts it.
So at any moment the root names finished frames only, and all of them.

Each surface carries ``primvars:contact:pressure`` [Pa], ``penetration`` [m] and ``partner``: the
index of the other body, n_body + p for half-space p, -1 for none. Pressure and penetration are
rounded to a thousandth of their largest value on the body, which packs them to half the size.
"""

import os
from pathlib import Path

import numpy as np
from pxr import Sdf, UsdGeom, Vt

from warp_contact.usd.prims import check_options, heated, parts, topology
from warp_contact.usd.reader import frame_numbers, open_stage, read_bodies, root_path

LEVELS = 1000  # distinct values of a scalar in a frame: the crate format packs up to about 1024


class UsdWriter:
    """Writes one frame of ``sim`` at each ``write()``; a context manager."""

    def __init__(
        self,
        path,
        sim,
        velocities: bool = False,
        tets: bool = True,
        flatten: bool = False,
        *,
        animate_tets: bool = False,
        view: tuple | None = None,
        pressure_scale: float | None = None,
        resume: bool = False,
    ):
        """Start a file; an earlier one at the same place is removed, or resumed.

        Args:
            path: a directory, whose name the root layer takes, or the ``.usda`` root layer itself
            sim: the simulation; its model, positions and contact fields are what is written
            velocities: write the surface velocities [m/s] too
            tets: write each body's TetMesh, purpose guide
            flatten: ``close()`` also writes everything into one ``<name>.usdc``
            animate_tets: time-sample the points of the TetMeshes, inner vertices included
            view: eye and target [m] of a camera to write
            pressure_scale: pressure [Pa] drawn as fully hot; None takes twice the hydrostatic
                pressure over the scene's size, or without gravity the highest pressure so far
            resume: continue after frame ``sim.frame`` of the earlier file, written with the
                same arguments; the frames after it are removed

        Raises:
            OSError: a file cannot be written, or there is none to resume
            ValueError: the path is that of another file, or the file to resume has no such
                frame or other bodies
        """
        check_options(sim, view, pressure_scale, (velocities, tets, flatten, animate_tets, resume))
        self.root, self.sim = root_path(path), sim
        self.velocities, self.flatten = velocities, flatten
        self.animate_tets = animate_tets and tets
        self.start, self.end, self.parts = None, None, parts(sim.model)
        self.base = np.concatenate([np.tile(p.color, (p.n_vert, 1)) for p in self.parts])
        self.scale = hydrostatic(sim) if pressure_scale is None else pressure_scale
        self.grows, self.layer = self.scale == 0.0, self._declare()
        if resume:
            self._reopen()
        else:
            self._begin(topology(self.parts, sim, tets, view))

    def _begin(self, prims: Sdf.Layer) -> None:
        """Remove an earlier file at the same place, and write what does not change."""
        self.root.unlink(missing_ok=True)
        self._remove()
        export(prims, self.root.parent / "topology.usdc")
        export(self.layer, self.root.parent / "manifest.usdc")
        self._write_root()

    def __enter__(self):
        """Return the writer."""
        return self

    def __exit__(self, kind, *_):
        """Close; after an error what was written stays and nothing is flattened."""
        if kind is None:
            self.close()

    def write(self) -> None:
        """Write the state of the simulation as frame ``sim.frame``."""
        frame = self.sim.frame
        if self.end is not None and frame != self.end + 1:
            raise ValueError(f"frame {frame} cannot follow frame {self.end}")
        for path, value in self._values():
            if self.end is not None:
                self.layer.EraseTimeSample(path, self.end)
            self.layer.SetTimeSample(path, frame, value)
        self.layer.customLayerData = {"pressureScale": self.scale}
        export(self.layer, self._frame(frame))
        self.start = frame if self.start is None else self.start
        self.end = frame
        self._write_root()

    def close(self) -> None:
        """Flatten, if asked to."""
        if self.flatten and self.end is not None:
            export(open_stage(self.root).Flatten(), self.root.with_suffix(".usdc"))

    def _frame(self, frame: int) -> Path:
        """The file of a frame."""
        return self.root.parent / "frames" / f"f.{frame:06d}.usdc"

    def _reopen(self) -> None:
        """Make the earlier file end at the frame of the simulation."""
        stage, frame = open_stage(self.root), self.sim.frame
        if [body.label for body in read_bodies(stage)] != list(self.sim.model.labels):
            raise ValueError(f"{self.root} has other bodies")
        if frame not in frame_numbers(stage) or not self._frame(frame).is_file():
            raise ValueError(f"{self.root} has no frame {frame} to go on from")
        last = Sdf.Layer.OpenAsAnonymous(str(self._frame(frame)))
        self.scale = last.customLayerData.get("pressureScale", self.scale)
        self.start, self.end = frame_numbers(stage)[0], frame
        self._write_root()
        self._remove(after=frame)

    def _remove(self, after: int = -1) -> None:
        """Remove the frames after one, unfinished files and the flattened file."""
        frames = self._frame(0).parent
        frames.mkdir(parents=True, exist_ok=True)
        kept = {self._frame(frame) for frame in range(after + 1)}
        for old in {*frames.glob("f.*.usdc"), *frames.glob(".tmp.*")} - kept:
            old.unlink(missing_ok=True)
        self.root.with_suffix(".usdc").unlink(missing_ok=True)

    def _values(self):
        """The attributes of this frame: path and value."""
        x = np.ascontiguousarray(self.sim.positions(), dtype=np.float32)
        v = np.asarray(self.sim.velocities(), dtype=np.float32) if self.velocities else None
        fields = self.sim.contact_fields()
        if self.grows:
            self.scale = max(self.scale, float(fields["pressure"].max(initial=0.0)))
        color = heated(self.base, fields["pressure"] / (self.scale or 1.0))
        for part in self.parts:
            mesh, points = f"{part.path}/surface.", Vt.Vec3fArray.FromNumpy(x[part.ids])
            yield mesh + "points", points
            yield mesh + "extent", UsdGeom.PointBased.ComputeExtent(points)
            if v is not None:
                yield mesh + "velocities", Vt.Vec3fArray.FromNumpy(v[part.ids])
            yield mesh + "primvars:displayColor", Vt.Vec3fArray.FromNumpy(color[part.ids])
            for name in "pressure", "penetration":
                value = Vt.FloatArray.FromNumpy(rounded(fields[name][part.ids]))
                yield f"{mesh}primvars:contact:{name}", value
            partner = np.ascontiguousarray(fields["partner"][part.ids], dtype=np.int32)
            yield mesh + "primvars:contact:partner", Vt.IntArray.FromNumpy(partner)
            if self.animate_tets:
                points = Vt.Vec3fArray.FromNumpy(x[slice(*part.verts)])
                yield f"{part.path}/sim.points", points
                yield f"{part.path}/sim.extent", UsdGeom.PointBased.ComputeExtent(points)

    def _declare(self) -> Sdf.Layer:
        """A layer that holds every attribute of a frame, without values."""
        layer = Sdf.Layer.CreateAnonymous(".usdc")
        layer.timeCodesPerSecond = layer.framesPerSecond = self.sim.fps
        types = Sdf.ValueTypeNames
        surface = {
            "points": types.Point3fArray,
            "extent": types.Float3Array,
            "primvars:displayColor": types.Color3fArray,
            "primvars:contact:pressure": types.FloatArray,
            "primvars:contact:penetration": types.FloatArray,
            "primvars:contact:partner": types.IntArray,
        }
        if self.velocities:
            surface["velocities"] = types.Vector3fArray
        prims = {"surface": surface}
        if self.animate_tets:
            prims["sim"] = {"points": types.Point3fArray, "extent": types.Float3Array}
        for part in self.parts:
            for prim, attributes in prims.items():
                spec = Sdf.CreatePrimInLayer(layer, f"{part.path}/{prim}")
                for name, kind in attributes.items():
                    Sdf.AttributeSpec(spec, name, kind)
        return layer

    def _write_root(self) -> None:
        """Make the root layer name the frames written so far."""
        layer = Sdf.Layer.CreateAnonymous(".usda")
        layer.subLayerPaths.append("./topology.usdc")
        layer.defaultPrim = "World"
        layer.timeCodesPerSecond = layer.framesPerSecond = self.sim.fps
        layer.startTimeCode = self.sim.frame if self.start is None else self.start
        layer.endTimeCode = layer.startTimeCode if self.end is None else self.end
        for key, value in ("upAxis", "Z"), ("metersPerUnit", 1.0), ("kilogramsPerUnit", 1.0):
            layer.pseudoRoot.SetInfo(key, value)
        world = Sdf.CreatePrimInLayer(layer, "/World")
        if self.end is not None:
            clips = {
                "templateAssetPath": "./frames/f.######.usdc",
                "templateStartTime": float(self.start),
                "templateEndTime": float(self.end),
                "templateStride": 1.0,
                "manifestAssetPath": Sdf.AssetPath("./manifest.usdc"),
                "primPath": "/World",
            }
            world.SetInfo("clips", {"default": clips})
        temporary = self.root.with_name(f".{self.root.name}.tmp")
        temporary.write_text(layer.ExportToString(), encoding="utf-8")
        os.replace(temporary, self.root)


def export(layer: Sdf.Layer, path: Path) -> None:
    """Write a layer so that ``path`` is either absent, old or complete."""
    temporary = path.with_name(f".tmp.{path.name}")
    if not layer.Export(str(temporary)):
        raise OSError(f"cannot write {path}")
    os.replace(temporary, path)


def rounded(value: np.ndarray) -> np.ndarray:
    """The values on a scale of at most ``LEVELS`` steps between 0 and their largest."""
    value = np.ascontiguousarray(value, dtype=np.float32)
    step = np.float32(np.abs(value).max(initial=0.0) / (LEVELS - 1))
    return np.rint(value / step) * step if step > 0.0 else value


def hydrostatic(sim) -> float:
    """Twice the pressure [Pa] at the bottom of a column as high as the scene; 0 without gravity."""
    densities = [getattr(material, "density", 0.0) or 0.0 for material in sim.model.materials]
    x = sim.positions()
    size = float(np.linalg.norm(np.ptp(x, axis=0)))
    return 2.0 * max(densities, default=0.0) * float(np.linalg.norm(sim.model.gravity)) * size
