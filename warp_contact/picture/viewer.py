"""A run in a browser: frames by a slider, pressures as colours, forces as arrows; needs viser.

It reads what is in the folder, and sees the frames that a run at work adds.
"""

import contextlib
import io
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from pxr import UsdGeom

from warp_contact.picture.forces import (
    arrows,
    contact_forces,
    hot,
    level_colors,
    primvar,
)
from warp_contact.picture.render import Drawing, chosen_camera
from warp_contact.usd.prims import GROUND, linear
from warp_contact.usd.reader import (
    frame_numbers,
    frame_rate,
    open_stage,
    read_note,
    read_view,
    world_points,
)

HOST = "localhost"  # nobody else on the network sees it
LOOKS = 12  # frames that are read for the largest pressure and force
ARROW = 0.25  # length of the largest force, of the size of the scene
CLEAR = 0.45  # opacity of bodies through which forces are seen
IDLE = 0.05  # between two looks at what is asked for [s]
PAUSE = 1.0  # between two looks at whether a run has gone on [s]


def srgb(color) -> tuple[int, ...]:
    """What a screen takes for a linear colour, 0 ... 255."""
    c = np.clip(color, 0.0, 1.0)
    s = np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1.0 / 2.4) - 0.055)
    return tuple(int(v) for v in np.rint(255.0 * s))


def quiet() -> contextlib.AbstractContextManager:
    """Within, viser prints no tables and lines of its own."""
    return contextlib.redirect_stdout(io.StringIO())


class Viewer:
    """Serves a stage at ``url`` until it is stopped.

    Attributes:
        url: what to open in a browser
        server: that of viser
        shown: the frame that is drawn
    """

    def __init__(self, path, port: int = 8080):
        """Read a stage and serve it.

        Args:
            path: as ``usd.open_stage`` takes it
            port: of the server; the next free one if it is taken

        Raises:
            ImportError: viser is not installed
            OSError: there is no stage
            ValueError: it holds no mesh
        """
        try:
            import viser
        except ImportError as error:
            raise ImportError("the viewer needs viser: pip install 'warp_contact[view]'") from error
        self.stage = open_stage(path)
        self.drawing, self.frames = Drawing.of(self.stage), frame_numbers(self.stage)
        self.fps, self.shown, self._looked = frame_rate(self.stage), -1, time.monotonic()
        self._root = Path(self.stage.GetRootLayer().realPath)
        self._changed = self._root.stat().st_mtime_ns
        ends = np.cumsum([0, *self.drawing.sizes])
        self._parts = [slice(*pair) for pair in pairwise(ends)]
        in_part = np.searchsorted(ends, self.drawing.tris[:, 0], side="right") - 1
        self._tris = [
            self.drawing.tris[in_part == k] - ends[k] for k in range(len(self.drawing.sizes))
        ]
        self.low, self.high = self.drawing.bounds(self.frames)
        self.size = float(np.linalg.norm(self.high - self.low))
        self.most = self._largest()
        with quiet():
            self.server = viser.ViserServer(HOST, port, label=self._root.stem, verbose=False)
        self.url = f"http://{HOST}:{self.server.get_port()}"
        self._add_scene()
        self._add_controls()
        self.show(self.frames[0])

    def fields(self, frame: int):
        """Positions [m], triangles, pressure [Pa] and partner of each mesh at a frame."""
        x = self.drawing.points(frame)
        for mesh, part, tris in zip(self.drawing.meshes, self._parts, self._tris, strict=True):
            n = part.stop - part.start
            pressure = primvar(mesh, "pressure", n, frame, 0.0)
            yield x[part], tris, pressure, primvar(mesh, "partner", n, frame, -1.0)

    def _largest(self) -> tuple[float, float]:
        """Largest pressure [Pa] and force [N] of some frames."""
        most = np.zeros(2)
        for frame in self.frames[:: max(1, len(self.frames) // LOOKS)]:
            for x, tris, pressure, partner in self.fields(frame):
                sizes = [np.linalg.norm(f) for _, f in contact_forces(x, tris, pressure, partner)]
                most = np.maximum(most, [pressure.max(initial=0.0), max(sizes, default=0.0)])
        return tuple(np.maximum(most, 1e-30).tolist())

    def _add_scene(self) -> None:
        """The nodes of all frames: a mesh of each body, levels of pressure, arrows, half-spaces."""
        scene, first = self.server.scene, self.frames[0]
        x, color = self.drawing.points(first), self.drawing.middle(self.drawing.colors(first))
        self.meshes = []
        for mesh, part, tris in zip(self.drawing.meshes, self._parts, self._tris, strict=True):
            name = str(mesh.GetPath().GetParentPath().name)
            add = {"color": srgb(color[part.start]), "flat_shading": True, "side": "double"}
            self.meshes.append(scene.add_mesh_simple(f"/bodies/{name}", x[part], tris, **add))
        none = np.zeros((3, 3)), np.array([[0, 1, 2]])
        self.levels = [
            scene.add_mesh_simple(f"/pressure/{k}", *none, color=srgb(c), side="double")
            for k, c in enumerate(level_colors())
        ]
        look = {"shaft_radius": 0.004, "head_radius": 0.01, "head_length": 0.03}
        look = {name: share * self.size for name, share in look.items()}
        self.arrows = scene.add_arrows("/forces", np.zeros((1, 2, 3)), (20, 20, 20), **look)
        ground, square = srgb(linear(GROUND)), np.array([[0, 1, 2], [0, 2, 3]])
        for mesh in half_spaces(self.stage):
            corners = world_points(mesh, first)
            scene.add_mesh_simple(f"/planes/{mesh.GetPath().name}", corners, square, color=ground)
        camera = chosen_camera(read_view(self.stage), None, None, self.low, self.high, 16 / 9)
        start = self.server.initial_camera
        start.position, start.look_at = camera.eye, camera.target
        start.fov = float(np.radians(camera.fov))

    def _add_controls(self) -> None:
        """Slider, playing, and what is shown."""
        gui, last = self.server.gui, self.frames[-1]
        first = self.frames[0]
        self.slider = gui.add_slider("frame", first, max(last, first + 1), 1, first)
        self.playing = gui.add_checkbox("play", False)
        self.speed = gui.add_slider("speed", 0.05, 2.0, 0.05, 1.0)
        self.pressures = gui.add_checkbox("pressures", True)
        self.hottest = gui.add_number("red at [Pa]", float(f"{self.most[0]:.3g}"), min=1e-30)
        self.forces = gui.add_checkbox("forces", False)
        self.said = gui.add_markdown("")
        for control in self.pressures, self.hottest, self.forces:
            control.on_update(lambda _: self._draw_again())

    def _draw_again(self) -> None:
        """Let the next turn draw the frame anew."""
        self.shown = -1

    def show(self, frame: int) -> None:
        """Draw a frame."""
        found, clear = list(self.fields(frame)), self.forces.value
        with self.server.atomic():
            for mesh, (x, *_) in zip(self.meshes, found, strict=True):
                mesh.vertices, mesh.opacity = np.float32(x), CLEAR if clear else None
            self._show_pressures(found)
            self._show_forces(found)
        most = max(pressure.max(initial=0.0) for _, _, pressure, _ in found)
        self.said.content = f"{frame / self.fps:.3f} s, largest pressure {most:.3g} Pa"
        self.shown = frame

    def _show_pressures(self, found: list) -> None:
        """The levels of pressure of a frame."""
        parts = [hot(x, tris, p, self.hottest.value) for x, tris, p, _ in found if p.any()]
        for k, node in enumerate(self.levels):
            corners = [part[k] for part in parts]
            x = np.concatenate(corners) if corners else np.zeros((0, 3))
            node.visible = self.pressures.value and len(x) > 0
            if node.visible:
                node.vertices = np.float32(x)
                node.faces = np.arange(len(x), dtype=np.uint32).reshape(-1, 3)

    def _show_forces(self, found: list) -> None:
        """The arrows of a frame."""
        forces = (
            [force for of in found for force in contact_forces(*of)] if self.forces.value else []
        )
        ends = arrows(forces, self.most[1], ARROW * self.size)
        self.arrows.visible = len(ends) > 0
        if len(ends):
            self.arrows.points = ends

    def turn(self) -> None:
        """Do what is due: look for frames of a run at work, go on to the next, draw."""
        if time.monotonic() - self._looked > PAUSE:
            self._look()
        if self.playing.value:
            frame = self.shown + 1
            self.slider.value = frame if frame in self.frames else self.frames[0]
        wanted = int(np.clip(self.slider.value, self.frames[0], self.frames[-1]))
        if wanted != self.shown:
            self.show(wanted)

    def _look(self) -> None:
        """Take in the frames that were written since the last look."""
        self._looked, changed = time.monotonic(), self._root.stat().st_mtime_ns
        if changed != self._changed:
            self._changed = changed
            self.stage.Reload()
            self.frames = frame_numbers(self.stage)
            self.slider.max = max(self.frames[-1], self.frames[0] + 1)

    def run(self) -> None:
        """Serve until the process is told to end, by an exception."""
        try:
            while True:
                begun = time.monotonic()
                self.turn()
                pause = 1.0 / (self.fps * self.speed.value) if self.playing.value else IDLE
                time.sleep(max(0.001, pause - (time.monotonic() - begun)))
        finally:
            self.stop()

    def stop(self) -> None:
        """Free the port."""
        with quiet():
            self.server.stop()


def half_spaces(stage) -> list[UsdGeom.Mesh]:
    """The squares that stand for half-spaces."""
    prims = stage.GetDefaultPrim().GetChildren() if stage.GetDefaultPrim() else ()
    return [UsdGeom.Mesh(p) for p in prims if p.IsA(UsdGeom.Mesh) and read_note(p, "normal")]
