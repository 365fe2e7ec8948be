"""Pictures of a USD file: what is drawn, from where, and a file for each frame."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import warp as wp
from pxr import Usd, UsdGeom

from warp_contact.picture.files import write_png
from warp_contact.picture.raycast import Camera, Renderer
from warp_contact.usd.prims import FOV, PALETTE, linear
from warp_contact.usd.reader import frame_numbers, open_stage, read_note, read_planes, read_view

DIRECTION = (0.55, -1.0, 0.5)  # from the scene toward an automatic camera
VIEW_MARGIN = 1.12  # room around the scene in an automatic view


def render(
    stage,
    out_dir,
    frames: Iterable[int] | None = None,
    size: tuple[int, int] = (960, 540),
    eye=None,
    target=None,
    *,
    samples: int = 2,
    rays: int = 4,
    wire: float = 0.0,
    floor: bool = True,
    device=None,
    report=None,
) -> list[Path]:
    """Draw frames of a stage as ``<out_dir>/NNNNNN.png`` and give their paths.

    Args:
        stage: a path that ``usd.open_stage`` takes, or an open stage
        out_dir: made if it is not there
        frames: frame numbers; None takes all
        size: width and height [pixels]
        eye: position of the camera [m]; None takes the camera of the file or, without one, a
            place from where all frames are in view
        target: what the camera looks at [m]; None as for ``eye``
        samples: rays along each side of a pixel
        rays: rays of each sample to the sun, and to the sky
        wire: how much the edges of the triangles are darkened, 0 ... 1
        floor: draw a ground under the lowest point where the scene has no half-space
        device: Warp device
        report: called with each path as it is written
    """
    if not isinstance(stage, Usd.Stage):
        stage = open_stage(stage)
    every, drawing = frame_numbers(stage), Drawing.of(stage)
    frames = chosen_frames(frames, every)
    low, high = drawing.bounds(every)
    camera = chosen_camera(read_view(stage), eye, target, low, high, size[0] / size[1])
    planes = read_planes(stage) or ([(np.array([0.0, 0.0, 1.0]), float(low[2]))] if floor else [])
    center, reach = 0.5 * (low + high), float(np.linalg.norm(high - low))
    with wp.ScopedDevice(device):
        rest = drawing.points(every[0])
        renderer = Renderer(drawing.tris, rest, planes, size, samples, rays, wire)
        return draw(drawing, frames, renderer, (camera, center, reach), Path(out_dir), report)


def draw(drawing, frames: list[int], renderer: Renderer, view: tuple, out_dir: Path, report):
    """Draw and write each frame in a view; give the paths."""
    paths = [out_dir / f"{frame:06d}.png" for frame in frames]
    out_dir.mkdir(parents=True, exist_ok=True)
    for frame, path in zip(frames, paths, strict=True):
        write_png(path, renderer.picture(drawing.points(frame), drawing.colors(frame), *view))
        if report is not None:
            report(path)
    return paths


def chosen_frames(frames: Iterable[int] | None, every: range) -> list[int]:
    """The frames asked for, or all; raises ValueError for one that is not there."""
    chosen = list(every if frames is None else frames)
    absent = [frame for frame in chosen if frame not in every]
    if absent:
        raise ValueError(f"no frame {absent[0]}: the file has {every[0]} to {every[-1]}")
    return chosen


@dataclass(frozen=True)
class Drawing:
    """The meshes of a stage as one: prims and triangles over all their points."""

    meshes: tuple[UsdGeom.Mesh, ...]
    tris: np.ndarray

    @classmethod
    def of(cls, stage: Usd.Stage) -> "Drawing":
        """Every visible mesh of a stage that is not a drawn half-space."""
        meshes, tris, first = [], [], 0
        time = stage.GetStartTimeCode()
        for prim in stage.Traverse():
            purpose = UsdGeom.Imageable(prim).ComputePurpose() if prim.IsA(UsdGeom.Mesh) else None
            if purpose not in ("default", "render") or read_note(prim, "normal") is not None:
                continue
            mesh = UsdGeom.Mesh(prim)
            counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get(time))
            indices = np.asarray(mesh.GetFaceVertexIndicesAttr().Get(time))
            tris.append(first + fans(counts, indices))
            first += len(mesh.GetPointsAttr().Get(time))
            meshes.append(mesh)
        if not meshes:
            raise ValueError("nothing to draw: the file has no visible mesh")
        return cls(tuple(meshes), np.concatenate(tris))

    def points(self, frame: float) -> np.ndarray:
        """Positions [m] at a frame, shape (n_vert, 3)."""
        return np.concatenate([world_points(mesh, frame) for mesh in self.meshes])

    def colors(self, frame: float) -> np.ndarray:
        """Linear colours at a frame, shape (n_vert, 3)."""
        result = []
        for k, mesh in enumerate(self.meshes):
            n = len(mesh.GetPointsAttr().Get(frame))
            color = mesh.GetDisplayColorPrimvar().ComputeFlattened(frame)
            color = np.asarray(color if color else [linear(PALETTE[k % len(PALETTE)])])
            result.append(color if len(color) == n else np.tile(color[:1], (n, 1)))
        return np.concatenate(result)

    def bounds(self, frames: Iterable[int]) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner [m] over the frames."""
        boxes = [(x.min(0), x.max(0)) for x in map(self.points, frames)]
        low, high = zip(*boxes, strict=True)
        return np.min(low, axis=0), np.max(high, axis=0)


def fans(counts: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Triangles of polygons, shape (n, 3)."""
    if (counts == 3).all():
        return indices.reshape(-1, 3)
    start = np.cumsum(counts) - counts
    polygon = np.repeat(np.arange(len(counts)), np.maximum(counts - 2, 0))
    k = np.arange(len(polygon)) - np.searchsorted(polygon, polygon)
    first = start[polygon]
    return np.stack([indices[first], indices[first + k + 1], indices[first + k + 2]], axis=1)


def world_points(mesh: UsdGeom.Mesh, frame: float) -> np.ndarray:
    """Points of a mesh in world coordinates [m], shape (n, 3)."""
    matrix = np.asarray(mesh.ComputeLocalToWorldTransform(frame))
    points = np.asarray(mesh.GetPointsAttr().Get(frame))
    if (matrix == np.eye(4)).all():
        return points
    return (points @ matrix[:3, :3] + matrix[3, :3]).astype(np.float32)


def chosen_camera(view, eye, target, low, high, aspect: float) -> Camera:
    """What was asked for, else the camera of the file, else one that sees everything."""
    if eye is None and target is None and view is not None:
        return Camera(*view)
    fitting = fitting_camera(low, high, aspect)
    target = fitting.target if target is None else np.asarray(target, dtype=float)
    eye = target + fitting.eye - fitting.target if eye is None else np.asarray(eye, dtype=float)
    return Camera(eye, target)


def fitting_camera(low: np.ndarray, high: np.ndarray, aspect: float) -> Camera:
    """A camera that sees the whole box."""
    target = 0.5 * (low + high)
    back = np.array(DIRECTION) / np.linalg.norm(DIRECTION)
    right, up, forward = Camera(target + back, target).axes()
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), -1).reshape(-1, 3) - target
    slope = np.tan(np.radians(FOV) / 2.0) / VIEW_MARGIN
    across = np.abs(corners @ right) / (slope * aspect) - corners @ forward
    upward = np.abs(corners @ up) / slope - corners @ forward
    return Camera(target + back * max(across.max(), upward.max(), 1e-6), target)
