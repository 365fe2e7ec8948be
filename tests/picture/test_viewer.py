"""The viewer: what is drawn of a frame, the controls, a run that goes on; by viser if it is there.

A stand-in takes its place otherwise: it keeps what it is given.
"""

import contextlib
import sys
import time
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from command_line import complaint

import warp_contact as wc
from warp_contact.command import cli
from warp_contact.picture import forces, viewer

SIDE, DENSITY = 0.1, 1000.0  # of the block [m], [kg/m^3]
WEIGHT = DENSITY * SIDE**3 * 9.81  # [N]


class Handle(SimpleNamespace):
    """A node or control that can be changed."""

    def on_update(self, call):
        """Remember what is called when a user changes it."""
        self.call = call


class Server:
    """What the viewer asks of a server."""

    def __init__(self, host, port, label, verbose):
        self.host, self.port, self.nodes, self.scene, self.gui = host, port, {}, self, self
        self.initial_camera = Handle()

    def add_mesh_simple(self, name, vertices, faces, **look):
        return self.nodes.setdefault(name, Handle(vertices=vertices, faces=faces, **look))

    def add_arrows(self, name, points, color, **look):
        return self.nodes.setdefault(name, Handle(points=points, **look))

    def add_slider(self, name, low, high, step, value):
        return Handle(min=low, max=high, value=value)

    def add_checkbox(self, name, value):
        return Handle(value=value)

    def add_number(self, name, value, min):
        return Handle(value=value)

    def add_markdown(self, content):
        return Handle(content=content)

    def get_port(self):
        return self.port

    def atomic(self):
        return contextlib.nullcontext()

    def stop(self):
        self.port = None


@pytest.fixture(params=["viser", "a stand-in"])
def viser(request, monkeypatch):
    """The library, or what stands in for it."""
    if request.param == "viser":
        return pytest.importorskip("viser")
    module = ModuleType("viser")
    module.ViserServer = Server
    monkeypatch.setitem(sys.modules, "viser", module)
    return module


@pytest.fixture
def run(tmp_path):
    """A block that lies on a floor, and the writer of its run; three frames are written."""
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0))
    rubber = wc.NeoHookean(1e5, 0.3, DENSITY, damping=4e-3)
    scene.add_body(wc.box(SIDE, 2), rubber, (0.0, 0.0, 0.5 * SIDE), label="block")
    sim = wc.Simulation(scene, integrator="implicit")
    for _ in sim.frames(40):
        pass
    with wc.UsdWriter(tmp_path / "run", sim) as writer:
        writer.write()
        for _ in sim.frames(2):
            writer.write()
        yield SimpleNamespace(sim=sim, writer=writer, path=tmp_path / "run")


@pytest.fixture
def shown(viser, run):
    """The viewer of that run."""
    view = viewer.Viewer(run.path, 8610)
    yield view
    view.stop()


def test_a_frame_shows_bodies_their_pressures_and_forces(shown, run):
    first, last = shown.frames[0], shown.frames[-1]
    assert (last - first, shown.shown) == (2, first)
    assert shown.url.startswith("http://localhost:86")
    (block,) = shown.meshes
    assert block.opacity is None and not shown.arrows.visible
    # Both colours of a vertex on the floor and of one beside it are there, the darkest is red.
    assert any(level.visible for level in shown.levels)
    shown.forces.value = True
    shown.slider.value = last
    shown.turn()
    assert shown.shown == last and f"{last / 60:.3f} s" in shown.said.content
    surface = np.unique(run.sim.scene.bodies[0].mesh.surface)
    np.testing.assert_allclose(block.vertices, run.sim.positions(0)[surface], atol=1e-6)
    assert block.opacity == viewer.CLEAR and shown.arrows.visible
    ((start, end),) = shown.arrows.points
    assert start == pytest.approx([0.0, 0.0, 0.0], abs=1e-3)
    assert end[2] > start[2] and end[:2] == pytest.approx(start[:2], abs=1e-3)


def test_the_force_on_a_block_at_rest_is_its_weight(shown):
    (block,) = shown.fields(shown.frames[-1])
    ((centre, force),) = forces.contact_forces(*block)
    print(force / WEIGHT)
    # At rest but for what still swings; pressures are rounded to a thousandth of the largest, and
    # friction, which spreads the foot, adds to their size.
    assert force == pytest.approx([0.0, 0.0, WEIGHT], rel=0.03, abs=1e-3 * WEIGHT)
    assert centre == pytest.approx([0.0, 0.0, 0.0], abs=1e-3)


def test_playing_goes_on_frame_by_frame_and_begins_again(shown):
    shown.playing.value, seen = True, []
    for _ in range(4):
        shown.turn()
        seen.append(shown.shown - shown.frames[0])
    assert seen == [1, 2, 0, 1]


def test_pressures_can_be_left_out_and_scaled(shown):
    shown.pressures.value = False
    shown.show(shown.frames[-1])
    assert not any(level.visible for level in shown.levels)
    shown.pressures.value = True
    shown.hottest.value = 1e-3 * shown.hottest.value  # all that touches is red
    shown.show(shown.frames[-1])
    assert [level.visible for level in shown.levels] == [False] * (forces.LEVELS - 1) + [True]


def test_a_run_at_work_gets_longer_while_it_is_shown(shown, run):
    end = shown.frames[-1]
    for _ in run.sim.frames(2):
        run.writer.write()
    shown.turn()
    assert shown.frames[-1] == end  # it looks now and then
    shown._looked = time.monotonic() - 2.0 * viewer.PAUSE
    shown.turn()
    assert shown.frames[-1] == shown.slider.max == end + 2
    shown.slider.value = end + 2
    shown.turn()
    surface = np.unique(run.sim.scene.bodies[0].mesh.surface)
    found = shown.meshes[0].vertices
    np.testing.assert_allclose(found, run.sim.positions(0)[surface], atol=1e-6)


def test_ctrl_c_ends_the_command_and_frees_the_port(viser, run, monkeypatch, capsys):
    def interrupted(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(viewer.Viewer, "turn", interrupted)
    assert cli.main(["view", str(run.path), "--port", "8620"]) == 0
    assert capsys.readouterr().out.startswith("http://localhost:86")


def test_without_viser_its_extra_is_named(run, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert cli.main(["view", str(run.path)]) == 1
    assert "pip install 'warp_contact[view]'" in complaint(capsys)
    assert cli.main(["view", str(run.path / "nothing")]) == 2
    assert "no such file" in complaint(capsys)


def test_levels_hold_every_triangle_under_pressure_once():
    x = np.array([[0.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])
    tris = np.array([[0, 2, 1], [0, 1, 3]])
    levels = forces.hot(x, tris, np.array([0.0, 0.0, 0.0, 3.0]), 1.0)
    assert [len(level) for level in levels] == [0] * (forces.LEVELS - 1) + [3]
    lifted = levels[-1] - x[[0, 1, 3]]  # along the outward normal, -y
    np.testing.assert_allclose(lifted, [[0.0, -forces.LIFT, 0.0]] * 3, atol=1e-12)
    assert not any(map(len, forces.hot(x, tris, np.zeros(4), 1.0)))
    assert (np.diff(forces.level_colors()[:, 2]) < 0.0).all()  # less blue from level to level


def test_arrows_have_the_length_of_their_force_and_weak_ones_are_left_out():
    point, force = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 5.0])
    ends = forces.arrows([(point, force), (point, 1e-4 * force)], 10.0, 0.5)
    np.testing.assert_allclose(ends, [[[1.0, 0.0, 0.0], [1.0, 0.0, 0.25]]], rtol=1e-6)
    assert forces.arrows([], 10.0, 0.5).shape == (0, 2, 3)
