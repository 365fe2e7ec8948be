"""Pictures of a USD file by a ray caster in Warp: no GPU, window or OpenGL is needed."""

import struct
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import warp as wp
from pxr import Usd, UsdGeom

from warp_contact.kernels import raycast
from warp_contact.usd import frame_numbers, open_stage, read_note, read_planes, read_view
from warp_contact.usd_scene import FOV, GROUND, PALETTE, linear

CREASE = 60.0  # edges with a sharper angle than this stay sharp [degrees]
DIRECTION = (0.55, -1.0, 0.5)  # from the scene toward an automatic camera
MARGIN = 1.12  # room around the scene in an automatic view
SUN = (-0.45, -0.55, 1.0)  # toward the sun


@dataclass(frozen=True)
class Camera:
    """Where the picture is taken from; ``fov`` is the vertical angle of view [degrees]."""

    eye: np.ndarray
    target: np.ndarray
    fov: float = FOV

    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Unit vectors to the right, up and forward."""
        forward = np.subtract(self.target, self.eye).astype(float)
        forward /= np.linalg.norm(forward)
        up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
        right = np.cross(forward, up)
        right /= np.linalg.norm(right)
        return right, np.cross(right, forward), forward


class Renderer:
    """Draws triangles that move but stay connected as they are."""

    def __init__(self, tris, rest, planes=(), size=(960, 540), samples=2, rays=4, wire=0.0):
        """Prepare for a mesh.

        Args:
            tris: triangles, shape (n_tri, 3)
            rest: positions [m] that decide which edges are sharp, shape (n_vert, 3)
            planes: normal and offset [m] of each half-space
            size: width and height [pixels]
            samples: rays along each side of a pixel
            rays: rays of each of them to the sun, and to the sky
            wire: how much the edges of the triangles are darkened, 0 ... 1
        """
        tris = np.ascontiguousarray(tris, dtype=np.int32).reshape(-1, 3)
        order = np.argsort(tris.ravel(), kind="stable")
        count = np.bincount(tris.ravel(), minlength=len(rest))
        self.size, self.samples, self.rays, self.wire = size, samples, rays, wire
        self.tri = wp.array(tris, dtype=wp.vec3i)
        self.index = wp.array(tris.ravel(), dtype=int)
        self.start = wp.array(np.append(0, np.cumsum(count)), dtype=int)
        self.around = wp.array(order // 3, dtype=int)
        self.rest = self._areas(wp.array(np.asarray(rest, dtype=np.float32), dtype=wp.vec3))
        rows = [(*np.asarray(n) / np.linalg.norm(n), h) for n, h in planes]
        self.plane = wp.array(np.array(rows, np.float32).reshape(-1, 4), dtype=wp.vec4)

    def picture(self, points, colors, camera: Camera, center=None, reach=None) -> np.ndarray:
        """The picture, shape (height, width, 3), uint8.

        Args:
            points: positions [m], shape (n_vert, 3)
            colors: linear colours, shape (n_vert, 3)
            camera: from where
            center: where the ground starts to fade [m]; None takes the middle of the points
            reach: size of the scene [m]; None takes that of the points
        """
        points = np.asarray(points, dtype=np.float32)
        low, high = points.min(0), points.max(0)
        center = 0.5 * (low + high) if center is None else center
        reach = float(np.linalg.norm(high - low)) if reach is None else reach
        x = wp.array(points, dtype=wp.vec3)
        mesh = wp.Mesh(points=x, indices=self.index)
        normal = self.corner_normals(x)
        color = wp.array(np.asarray(colors, dtype=np.float32), dtype=wp.vec3)
        width, height = self.size
        picture = wp.empty(width * height, dtype=wp.vec3)
        wp.launch(
            raycast.cast,
            dim=width * height,
            inputs=[self._view(camera), light(mesh, center, reach), self.plane, color, normal],
            outputs=[picture],
        )
        return np.rint(255.0 * picture.numpy()).astype(np.uint8).reshape(height, width, 3)

    def corner_normals(self, x: wp.array) -> wp.array:
        """Normals of the corners of the triangles, shape (3 n_tri,)."""
        normal = wp.empty(3 * len(self.tri), dtype=wp.vec3)
        crease = float(np.cos(np.radians(CREASE)))
        inputs = [self.tri, self.start, self.around, self.rest, self._areas(x), crease]
        wp.launch(raycast.set_corner_normals, dim=len(normal), inputs=inputs, outputs=[normal])
        return normal

    def _areas(self, x: wp.array) -> wp.array:
        """Area vectors of the triangles."""
        area = wp.empty(len(self.tri), dtype=wp.vec3)
        inputs = [x, self.tri]
        wp.launch(raycast.set_face_normals, dim=len(area), inputs=inputs, outputs=[area])
        return area

    def _view(self, camera: Camera) -> raycast.View:
        """The camera as the kernel takes it."""
        view, (right, up, forward) = raycast.View(), camera.axes()
        height = np.tan(np.radians(camera.fov) / 2.0)
        view.width, view.height = self.size
        view.eye, view.forward = wp.vec3(*map(float, camera.eye)), wp.vec3(*map(float, forward))
        view.right = wp.vec3(*map(float, right * height * self.size[0] / self.size[1]))
        view.up = wp.vec3(*map(float, up * height))
        view.samples, view.rays, view.wire = self.samples, self.rays, self.wire
        return view


def light(mesh: wp.Mesh, center, reach: float) -> raycast.Light:
    """A low warm sun and a bright sky over a neutral ground."""
    result = raycast.Light()
    result.mesh = mesh.id
    result.sun = wp.normalize(wp.vec3(*SUN))
    result.sun_power, result.sun_size = 0.85, 0.12
    result.sky, result.bounce = wp.vec3(0.50, 0.53, 0.58), wp.vec3(0.24, 0.23, 0.22)
    result.high, result.low = wp.vec3(*linear_floats("dfe6ee")), wp.vec3(*linear_floats("f6f6f4"))
    result.ground = wp.vec3(*linear_floats(GROUND))
    result.center, result.reach = wp.vec3(*map(float, center)), float(reach)
    return result


def linear_floats(srgb: str) -> tuple[float, ...]:
    """Linear colour of an sRGB hex code, as Python floats."""
    return tuple(map(float, linear(srgb)))


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


def fitting_camera(low: np.ndarray, high: np.ndarray, aspect: float) -> Camera:
    """A camera that sees the whole box."""
    target = 0.5 * (low + high)
    back = np.array(DIRECTION) / np.linalg.norm(DIRECTION)
    right, up, forward = Camera(target + back, target).axes()
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), -1).reshape(-1, 3) - target
    slope = np.tan(np.radians(FOV) / 2.0) / MARGIN
    across = np.abs(corners @ right) / (slope * aspect) - corners @ forward
    upward = np.abs(corners @ up) / slope - corners @ forward
    return Camera(target + back * max(across.max(), upward.max(), 1e-6), target)


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
        rays: rays of each of them to the sun, and to the sky
        wire: how much the edges of the triangles are darkened, 0 ... 1
        floor: draw a ground under the lowest point where the scene has no half-space
        device: Warp device
        report: called with each path as it is written
    """
    stage = stage if isinstance(stage, Usd.Stage) else open_stage(stage)
    every, drawing = frame_numbers(stage), Drawing.of(stage)
    frames = every if frames is None else list(frames)
    absent = [frame for frame in frames if frame not in every]
    if absent:
        raise ValueError(f"no frame {absent[0]}: the file has {every[0]} to {every[-1]}")
    low, high = drawing.bounds(every)
    camera = chosen_camera(read_view(stage), eye, target, low, high, size[0] / size[1])
    planes = read_planes(stage)
    if floor and not planes:
        planes = [(np.array([0.0, 0.0, 1.0]), float(low[2]))]
    out_dir, paths = Path(out_dir), []
    out_dir.mkdir(parents=True, exist_ok=True)
    with wp.ScopedDevice(device):
        rest = drawing.points(every[0])
        renderer = Renderer(drawing.tris, rest, planes, size, samples, rays, wire)
        reach, center = float(np.linalg.norm(high - low)), 0.5 * (low + high)
        for frame in frames:
            points, colors = drawing.points(frame), drawing.colors(frame)
            paths.append(out_dir / f"{frame:06d}.png")
            write_png(paths[-1], renderer.picture(points, colors, camera, center, reach))
            if report is not None:
                report(paths[-1])
    return paths


def chosen_camera(view, eye, target, low, high, aspect: float) -> Camera:
    """What was asked for, else the camera of the file, else one that sees everything."""
    if eye is None and target is None and view is not None:
        return Camera(*view)
    fitting = fitting_camera(low, high, aspect)
    target = fitting.target if target is None else np.asarray(target, dtype=float)
    eye = target + fitting.eye - fitting.target if eye is None else np.asarray(eye, dtype=float)
    return Camera(eye, target)


def write_png(path, picture: np.ndarray) -> None:
    """Write an (height, width, 3) uint8 array, with Pillow if it is there."""
    try:
        from PIL import Image
    except ImportError:
        Path(path).write_bytes(png(picture))
    else:
        Image.fromarray(picture).save(path)


def png(picture: np.ndarray) -> bytes:
    """A PNG file by the standard library alone."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        checksum = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", checksum)

    height, width, _ = picture.shape
    rows = np.ascontiguousarray(picture, dtype=np.int16).reshape(height, 3 * width)
    rows = np.diff(rows, axis=0, prepend=np.zeros((1, 3 * width), np.int16)).astype(np.uint8)
    lines = np.insert(rows, 0, 2, axis=1)  # filter 2: each byte minus the one above
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(lines.tobytes(), 6))
        + chunk(b"IEND", b"")
    )


def animate(pictures: Iterable, path, fps: float = 30.0) -> None:
    """Join picture files into an animated WebP or GIF, by the suffix of ``path``; needs Pillow.

    A GIF plays at 50 pictures a second at most: viewers slow down a faster one.
    """
    try:
        from PIL import Image
    except ImportError as error:
        raise ImportError("animations need Pillow: pip install warp_contact[render]") from error
    images = [Image.open(picture).convert("RGB") for picture in pictures]
    webp = Path(path).suffix == ".webp"
    options = {"quality": 80, "method": 4} if webp else {}
    images[0].save(
        path,
        save_all=True,
        append_images=images[1:],
        duration=max(round(1000.0 / fps), 1 if webp else 20),
        loop=0,
        **options,
    )
