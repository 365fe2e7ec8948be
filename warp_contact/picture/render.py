"""Pictures of a USD file: what is drawn, from where, and a file for each frame."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import warp as wp
from pxr import Usd, UsdGeom

from warp_contact import checks
from warp_contact.picture.files import write_png
from warp_contact.picture.raycast import Camera, Renderer
from warp_contact.picture.textures import vertex_colors
from warp_contact.usd.prims import FOV, PALETTE, linear
from warp_contact.usd.reader import (
    frame_numbers,
    open_stage,
    place,
    read_note,
    read_planes,
    read_view,
    world_points,
)

DIRECTION = (0.55, -1.0, 0.5)  # from the scene toward an automatic camera
VIEW_MARGIN = 1.12  # room around the scene in an automatic view
FAR = 1e18  # [m]: squares of what is beyond have no place in float32
WIDEST, FINEST = 16_384, 64  # pixels along a side, rays along a side of one: more take for ever


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
    cut=None,
    device=None,
    report=None,
) -> list[Path]:
    """Draw frames of a stage as ``<out_dir>/NNNNNN.png``, give their paths; or raise ValueError.

    Args:
        stage: a path that ``usd.open_stage`` takes, or an open stage
        out_dir: made if it is not there
        frames: frame numbers; None takes all
        size: width and height [pixels]
        eye: position of the camera [m]; None takes that of the file or one that sees all frames
        target: what the camera looks at [m]; None as for ``eye``
        samples: rays along each side of a pixel
        rays: rays of each sample to the sun, and to the sky
        wire: how much the edges of the triangles are darkened, 0 ... 1
        cut: n and d: of bodies what lies at n . x > d [m] is not drawn, shape (4,)
        device: Warp device
        report: called with each path as it is written
    """
    size, *quality = checked_quality(size, samples, rays, wire, cut)
    if not isinstance(stage, Usd.Stage):
        stage = open_stage(stage)
    every, drawing = frame_numbers(stage), Drawing.of(stage)
    frames = chosen_frames(frames, every)
    low, high = drawing.bounds(every)
    camera = chosen_camera(read_view(stage), eye, target, low, high, size[0] / size[1])
    planes = read_planes(stage) or [(np.array([0.0, 0.0, 1.0]), float(low[2]))]
    center, reach = 0.5 * (low + high), float(np.linalg.norm(high - low))
    with wp.ScopedDevice(device):
        rest = drawing.points(every[0])
        renderer = Renderer(drawing.tris, rest, planes, size, *quality)
        return draw(drawing, frames, renderer, (camera, center, reach), Path(out_dir), report)


def checked_quality(size, samples, rays, wire, cut) -> tuple:
    """What a picture costs, and what it shows; raises ValueError for what cannot work."""
    size = tuple(checks.count(pixels, "size", most=WIDEST) for pixels in size)
    samples, rays = (
        checks.count(value, name, most=FINEST)
        for value, name in ((samples, "samples"), (rays, "rays"))
    )
    if cut is not None:
        *n, d = checks.numbers(cut, (4,), "cut")
        if not any(n):
            raise checks.refuse("cut", list(cut), "a normal that is not zero, and an offset")
        cut = n, d
    return size, samples, rays, checks.number(wire, "wire", 0.0, 1.0), cut


def draw(drawing, frames: list[int], renderer: Renderer, view: tuple, out_dir: Path, report):
    """Draw and write each frame in a view; give the paths."""
    paths = [out_dir / f"{frame:06d}.png" for frame in frames]
    out_dir.mkdir(parents=True, exist_ok=True)
    for frame, path in zip(frames, paths, strict=True):
        colors = drawing.colors(frame)
        shown = drawing.points(frame), colors, *view, drawing.middle(colors)
        write_png(path, renderer.picture(*shown))
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
    """The meshes of a stage as one: prims, counts of points, triangles over all points.

    ``textures`` has the colours of those with a texture, None for the others.
    """

    meshes: tuple[UsdGeom.Mesh, ...]
    sizes: tuple[int, ...]
    tris: np.ndarray
    textures: tuple[np.ndarray | None, ...]

    @classmethod
    def of(cls, stage: Usd.Stage) -> "Drawing":
        """Every visible mesh of a stage that is not a drawn half-space.

        Raises:
            ValueError: there is none, or its faces do not fit its points
        """
        meshes, sizes, tris, first = [], [], [], 0
        time = stage.GetStartTimeCode()
        for prim in stage.Traverse():
            purpose = UsdGeom.Imageable(prim).ComputePurpose() if prim.IsA(UsdGeom.Mesh) else None
            if purpose not in ("default", "render") or read_note(prim, "normal") is not None:
                continue
            mesh = UsdGeom.Mesh(prim)
            n = len(mesh.GetPointsAttr().Get(time) or ())
            tris.append(first + faces(mesh, n, time))
            sizes.append(n)
            first += n
            meshes.append(mesh)
        if not meshes or not sum(map(len, tris)):
            name = stage.GetRootLayer().GetDisplayName()
            raise ValueError(f"nothing to draw: {name} has no visible mesh with faces")
        textures = tuple(map(vertex_colors, meshes, sizes))
        return cls(tuple(meshes), tuple(sizes), np.concatenate(tris), textures)

    def points(self, frame: float) -> np.ndarray:
        """Positions [m] at a frame, shape (n_vert, 3); raises ValueError where there are none."""
        parts = zip(self.meshes, self.sizes, strict=True)
        return np.concatenate([checked_points(mesh, n, frame) for mesh, n in parts])

    def colors(self, frame: float) -> np.ndarray:
        """Linear colours at a frame, shape (n_vert, 3)."""
        result = []
        for k, (mesh, n) in enumerate(zip(self.meshes, self.sizes, strict=True)):
            color = self.textures[k]
            if color is None:
                color = mesh.GetDisplayColorPrimvar().ComputeFlattened(frame)
                color = np.asarray(color if color else [linear(PALETTE[k % len(PALETTE)])])
            color = np.nan_to_num(np.clip(color, 0.0, 1.0))
            result.append(color if len(color) == n else np.tile(color[:1], (n, 1)))
        return np.concatenate(result)

    def middle(self, colors: np.ndarray) -> np.ndarray:
        """The colour of most points of a mesh, for all of its points, shape (n_vert, 3)."""
        ends = np.cumsum(self.sizes)[:-1]
        parts = [np.median(part, axis=0) for part in np.split(colors, ends)]
        return np.repeat(parts, self.sizes, axis=0)

    def bounds(self, frames: Iterable[int]) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner [m] over the frames."""
        boxes = [(x.min(0), x.max(0)) for x in map(self.points, frames)]
        low, high = zip(*boxes, strict=True)
        return np.min(low, axis=0), np.max(high, axis=0)


def faces(mesh: UsdGeom.Mesh, n: int, time: float) -> np.ndarray:
    """Triangles of a mesh of ``n`` points, shape (n_tri, 3); raises ValueError for wrong ones."""
    counts = mesh.GetFaceVertexCountsAttr().Get(time) or ()
    indices = mesh.GetFaceVertexIndicesAttr().Get(time) or ()
    counts, indices = (np.asarray(values, dtype=np.int64) for values in (counts, indices))
    fit = (counts >= 0).all() and counts.sum() == len(indices)
    if not fit or indices.min(initial=0) < 0 or indices.max(initial=-1) >= n:
        raise ValueError(f"the faces of {place(mesh.GetPrim())} do not fit its {n} points")
    return fans(counts, indices)


def fans(counts: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Triangles of polygons, shape (n, 3)."""
    if (counts == 3).all():
        return indices.reshape(-1, 3)
    start = np.cumsum(counts) - counts
    polygon = np.repeat(np.arange(len(counts)), np.maximum(counts - 2, 0))
    k = np.arange(len(polygon)) - np.searchsorted(polygon, polygon)
    first = start[polygon]
    return np.stack([indices[first], indices[first + k + 1], indices[first + k + 2]], axis=1)


def checked_points(mesh: UsdGeom.Mesh, n: int, frame: float) -> np.ndarray:
    """The ``n`` points of a mesh in world coordinates [m], shape (n, 3)."""
    points = world_points(mesh, frame)
    where = f"{place(mesh.GetPrim())} at frame {frame:g}"
    if points.shape != (n, 3):
        raise ValueError(f"{where} has {len(points)} points, not {n}: is a file of it missing?")
    if not (np.abs(points) < FAR).all():
        raise ValueError(
            f"{place(mesh.GetPrim())} has points at frame {frame:g} that are not finite"
        )
    return points


def chosen_camera(view, eye, target, low, high, aspect: float) -> Camera:
    """What was asked for, else the camera of the file, else one that sees everything."""
    if eye is None and target is None and view is not None:
        eye, target = view
    fitting = fitting_camera(low, high, aspect)
    target = fitting.target if target is None else checks.numbers(target, (3,), "target")
    eye = target + fitting.eye - fitting.target if eye is None else eye
    return Camera(*checks.sight(eye, target))


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
