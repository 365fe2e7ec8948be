"""Pictures of moving triangles by a ray caster in Warp: no GPU, window or OpenGL is needed."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_contact.kernels.output import raycast as kernels
from warp_contact.usd.prims import FOV, GROUND, linear

CREASE_ANGLE = 60.0  # edges with a sharper angle than this stay sharp [degrees]
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
    """Draws moving triangles of constant connectivity."""

    def __init__(
        self, tris, rest, planes=(), size=(960, 540), samples=2, rays=4, wire=0.0, cut=None
    ):
        """Prepare for a mesh.

        Args:
            tris: triangles, shape (n_tri, 3)
            rest: positions [m] that decide which edges are sharp, shape (n_vert, 3)
            planes: normal and offset [m] of each half-space
            size: width and height [pixels]
            samples: rays along each side of a pixel
            rays: rays of each sample to the sun, and to the sky
            wire: how much the edges of the triangles are darkened, 0 ... 1
            cut: normal and offset [m] of a plane beyond which no body is drawn
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
        n, d = ((0.0, 0.0, 0.0), 1.0) if cut is None else cut
        self.cut = wp.vec4(*(np.append(n, d) / (np.linalg.norm(n) or 1.0)))
        rows = [(*np.asarray(n) / np.linalg.norm(n), h) for n, h in planes]
        self.plane = wp.array(np.array(rows, np.float32).reshape(-1, 4), dtype=wp.vec4)

    def picture(
        self, points, colors, camera: Camera, center=None, reach=None, inside=None
    ) -> np.ndarray:
        """The picture, shape (height, width, 3), uint8.

        Args:
            points: positions [m], shape (n_vert, 3)
            colors: linear colours, shape (n_vert, 3)
            camera: from where
            center: where the ground starts to fade [m]; None takes the middle of the points
            reach: size of the scene [m]; None takes that of the points
            inside: linear colours where a body is cut, of its vertices; None takes ``colors``
        """
        points = np.asarray(points, dtype=np.float32)
        low, high = points.min(0), points.max(0)
        center = 0.5 * (low + high) if center is None else center
        reach = float(np.linalg.norm(high - low)) if reach is None else reach
        x = wp.array(points, dtype=wp.vec3)
        mesh = wp.Mesh(points=x, indices=self.index)
        normal = self.corner_normals(x)
        color = wp.array(np.asarray(colors, dtype=np.float32), dtype=wp.vec3)
        core = color if inside is None else wp.array(np.float32(inside), dtype=wp.vec3)
        width, height = self.size
        picture = wp.empty(width * height, dtype=wp.vec3)
        wp.launch(
            kernels.cast,
            dim=width * height,
            inputs=[self._view(camera), light(mesh, center, reach, self.cut), self.plane]
            + [color, normal, core],
            outputs=[picture],
        )
        return np.rint(255.0 * picture.numpy()).astype(np.uint8).reshape(height, width, 3)

    def corner_normals(self, x: wp.array) -> wp.array:
        """Normals of the corners of the triangles, shape (3 n_tri,)."""
        normal = wp.empty(3 * len(self.tri), dtype=wp.vec3)
        crease = float(np.cos(np.radians(CREASE_ANGLE)))
        inputs = [self.tri, self.start, self.around, self.rest, self._areas(x), crease]
        wp.launch(kernels.set_corner_normals, dim=len(normal), inputs=inputs, outputs=[normal])
        return normal

    def _areas(self, x: wp.array) -> wp.array:
        """Area vectors of the triangles."""
        area = wp.empty(len(self.tri), dtype=wp.vec3)
        inputs = [x, self.tri]
        wp.launch(kernels.set_face_normals, dim=len(area), inputs=inputs, outputs=[area])
        return area

    def _view(self, camera: Camera) -> kernels.View:
        """The camera as the kernel takes it."""
        view, (right, up, forward) = kernels.View(), camera.axes()
        height = np.tan(np.radians(camera.fov) / 2.0)
        view.width, view.height = self.size
        view.eye, view.forward = wp.vec3(camera.eye), wp.vec3(forward)
        view.right = wp.vec3(right * height * self.size[0] / self.size[1])
        view.up = wp.vec3(up * height)
        view.samples, view.rays, view.wire = self.samples, self.rays, self.wire
        return view


def light(mesh: wp.Mesh, center, reach: float, cut: wp.vec4) -> kernels.Light:
    """A low warm sun and a bright sky over a neutral ground."""
    result = kernels.Light()
    result.mesh, result.cut = mesh.id, cut
    result.sun = wp.normalize(wp.vec3(SUN))
    result.sun_power, result.sun_size = 0.85, 0.12
    result.sky, result.bounce = wp.vec3(0.50, 0.53, 0.58), wp.vec3(0.24, 0.23, 0.22)
    result.high, result.low = wp.vec3(linear("dfe6ee")), wp.vec3(linear("f6f6f4"))
    result.ground = wp.vec3(linear(GROUND))
    result.center, result.reach = wp.vec3(center), float(reach)
    return result
