"""warp_contact/usd.py and usd_check.py: what is written, what is checked, what a kill leaves."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp
from pxr import Sdf, Usd, UsdGeom, UsdShade

from warp_contact import usd
from warp_contact.usd_check import problems

N = 4  # cells along each edge of a cube
KILLS = 10


def cube(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, positively oriented tets and outward surface of a unit cube of n^3 cells."""
    m = n + 1
    x = np.stack(np.meshgrid(*[np.arange(m)] * 3, indexing="ij"), -1).reshape(-1, 3)
    start = x[(x < n).all(1)]
    paths = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]])
    tets = []
    for k, path in enumerate(paths):
        corners = [start]
        for axis in path:
            corners.append(corners[-1] + np.eye(3, dtype=int)[axis])
        ids = np.stack([c @ [m * m, m, 1] for c in corners], 1)
        tets.append(ids if k < 3 else ids[:, [0, 2, 1, 3]])
    tets = np.concatenate(tets)
    faces = np.concatenate([tets[:, f] for f in ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1])])
    _, first, count = np.unique(np.sort(faces, 1), axis=0, return_index=True, return_counts=True)
    return x / n, tets, faces[first[count == 1]]


class FakeSimulation:
    """Cubes on an orbit: the interface the writer needs, with positions known at every frame."""

    def __init__(self, labels=("left", "right"), n=N, fps=60):
        x, tets, tris = cube(n)
        k, i = len(labels), np.arange(len(labels))
        self.rest = np.concatenate([x + np.array([2.0 * b, 0.0, 0.5]) for b in i]).astype(
            np.float32
        )
        flat = np.concatenate([b * len(x) + tets for b in i])
        faces = np.concatenate([b * len(x) + tris for b in i])
        material = SimpleNamespace(youngs_modulus=1e5, poisson_ratio=0.4, density=1000.0)
        free = np.repeat(i > 0, len(x)) if k > 2 else np.ones(k * len(x))

        def ints(values, kind=wp.int32):
            return wp.array(np.asarray(values, dtype=np.int32), dtype=kind, device="cpu")

        self.model = SimpleNamespace(
            labels=tuple(labels),
            materials=(material,) * k,
            gravity=(0.0, 0.0, -9.81),
            n_body=k,
            n_vert=k * len(x),
            body_vert=ints(np.arange(k + 1) * len(x)),
            body_tet=ints(np.arange(k + 1) * len(tets)),
            body_tri=ints(np.arange(k + 1) * len(tris)),
            tets=ints(flat, wp.vec4i),
            tris=ints(faces, wp.vec3i),
            inv_mass=wp.array(free, dtype=float, device="cpu"),
            plane_n=wp.array([[0.0, 0.0, 1.0]], dtype=wp.vec3, device="cpu"),
            plane_h=wp.array([0.0], dtype=float, device="cpu"),
        )
        self.scene = SimpleNamespace(
            bodies=[SimpleNamespace(x=part) for part in np.split(self.rest, k)]
        )
        self.fps, self.frame = fps, 0

    def at(self, frame):
        """Positions [m] at a frame."""
        wave = 0.1 * np.sin(0.1 * frame + 3.0 * self.rest[:, :1])
        return (self.rest + wave * [0.2, 0.5, 1.0]).astype(np.float32)

    def positions(self, body=None):
        """Positions [m]."""
        vert = self.model.body_vert.numpy()
        x = self.at(self.frame)
        return x if body is None else x[vert[body] : vert[body + 1]]

    def velocities(self, body=None):
        """Velocities [m/s]."""
        return np.zeros_like(self.positions(body))

    def contact_fields(self):
        """Contact on the lower third of each body."""
        height = self.rest[:, 2] - 0.5
        depth = np.maximum(0.3 - height, 0.0).astype(np.float32) * abs(np.sin(0.1 * self.frame))
        return {
            "pressure": 2e4 * depth * (1.0 + self.rest[:, 0]),
            "penetration": 1e-3 * depth,
            "partner": np.where(depth > 0.0, 0, -1).astype(np.int32),
        }


def written(path, n_frames=5, sim=None, **options) -> Usd.Stage:
    """The stage after frames 0 ... n_frames."""
    sim = sim or FakeSimulation()
    with usd.UsdWriter(path, sim, **options) as writer:
        for sim.frame in range(n_frames + 1):
            writer.write()
    return usd.open_stage(path)


def surface_ids(sim, b):
    """Surface vertices of a body in the flat arrays."""
    tri = sim.model.body_tri.numpy()
    return np.unique(sim.model.tris.numpy()[tri[b] : tri[b + 1]])


def copied(stage) -> Usd.Stage:
    """A stage in memory with the same content, free to be damaged."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(stage.Flatten())
    return Usd.Stage.Open(layer)


def test_every_frame_reads_back_at_its_time(tmp_path):
    stage = written(tmp_path / "two", 7)
    sim = FakeSimulation()
    assert list(usd.frame_numbers(stage)) == list(range(8))
    for frame in range(8):
        points = usd.read_points(stage, frame)
        for b, label in enumerate(sim.model.labels):
            np.testing.assert_array_equal(points[label], sim.at(frame)[surface_ids(sim, b)])


def test_nothing_is_wrong_with_what_is_written(tmp_path):
    sim = FakeSimulation(labels=("a", "b", "c"))
    written(tmp_path / "three", sim=sim, velocities=True, animate_tets=True, flatten=True)
    assert problems(tmp_path / "three") == []
    assert problems(tmp_path / "three" / "three.usdc") == []


def test_the_stage_is_valid_before_and_after_each_frame(tmp_path):
    sim = FakeSimulation()
    writer = usd.UsdWriter(tmp_path, sim)
    assert len(usd.read_bodies(usd.open_stage(tmp_path))) == 2
    for sim.frame in range(3):
        writer.write()
        stage = usd.open_stage(tmp_path)
        assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, sim.frame)
        assert problems(tmp_path) == []


def test_flattened_file_holds_the_same_frames(tmp_path):
    stage = written(tmp_path / "run", flatten=True)
    flat = Usd.Stage.Open(str(tmp_path / "run" / "run.usdc"))
    for frame in usd.frame_numbers(stage):
        expected = usd.read_points(stage, frame)
        for label, points in usd.read_points(flat, frame).items():
            np.testing.assert_array_equal(points, expected[label])


def test_layout_metadata_and_schemas(tmp_path):
    stage = written(tmp_path / "run", sim=FakeSimulation(fps=24))
    root = stage.GetRootLayer()
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert (root.timeCodesPerSecond, root.framesPerSecond, root.defaultPrim) == (24, 24, "World")
    body = stage.GetPrimAtPath("/World/left")
    assert "PhysicsDeformableBodyAPI" in body.GetMetadata("apiSchemas").GetAppliedItems()
    sim = UsdGeom.TetMesh.Get(stage, "/World/left/sim")
    assert sim.GetPurposeAttr().Get() == "guide"
    faces = UsdGeom.TetMesh.ComputeSurfaceFaces(sim, Usd.TimeCode.Default())
    own = sim.GetSurfaceFaceVertexIndicesAttr().Get()
    assert {tuple(sorted(f)) for f in faces} == {tuple(sorted(f)) for f in own}
    material, _ = UsdShade.MaterialBindingAPI(sim).ComputeBoundMaterial("physics")
    assert material.GetPrim().GetAttribute("physics:youngsModulus").Get() == pytest.approx(1e5)
    surface = stage.GetPrimAtPath("/World/left/surface")
    look, _ = UsdShade.MaterialBindingAPI(surface).ComputeBoundMaterial()
    assert look.GetPath() == "/World/Looks/contact"
    ((n, h),) = usd.read_planes(stage)
    assert (*n, h) == (0.0, 0.0, 1.0, 0.0)


def test_labels_become_valid_and_different_prims(tmp_path):
    labels = ("my apple", "my-apple", "1st", "Looks")
    stage = written(tmp_path / "names", 1, sim=FakeSimulation(labels, n=1))
    assert [body.label for body in usd.read_bodies(stage)] == list(labels)
    assert len({body.mesh.GetPath() for body in usd.read_bodies(stage)}) == 4
    assert problems(tmp_path / "names") == []


def test_contact_primvars_are_rounded_by_a_thousandth(tmp_path):
    sim = FakeSimulation(n=12)
    stage = written(tmp_path / "run", 5, sim=sim)
    ids = surface_ids(sim, 1)
    expected = sim.contact_fields()["pressure"][ids]
    prim = stage.GetPrimAtPath("/World/right/surface")
    pressure = np.asarray(prim.GetAttribute("primvars:contact:pressure").Get(5))
    assert len(np.unique(usd.rounded(np.linspace(0.0, 7.0, 100_000)))) == usd.LEVELS
    # Half a step of LEVELS - 1 steps up to the largest value.
    np.testing.assert_allclose(pressure, expected, atol=0.51 * expected.max() / 999)
    color = np.asarray(prim.GetAttribute("primvars:displayColor").Get(5))
    assert color[expected.argmax(), 0] > color[expected.argmin(), 0]


def test_a_frame_costs_about_what_its_points_cost(tmp_path):
    sim = FakeSimulation(n=24)
    written(tmp_path / "run", 3, sim=sim, tets=False)
    n = 2 * len(surface_ids(sim, 0))
    size = (tmp_path / "run" / "frames" / "f.000003.usdc").stat().st_size
    # Points and colours take 12 bytes each, the packed scalars at most 4.
    assert size < 28 * n + 4096


def test_a_second_run_replaces_the_first(tmp_path):
    written(tmp_path / "run", 6, flatten=True)
    stage = written(tmp_path / "run", 2)
    assert stage.GetEndTimeCode() == 2
    assert len(list((tmp_path / "run" / "frames").iterdir())) == 3
    assert not (tmp_path / "run" / "run.usdc").exists()
    assert problems(tmp_path / "run") == []


def test_frames_must_follow_each_other(tmp_path):
    sim = FakeSimulation(n=1)
    writer = usd.UsdWriter(tmp_path / "run", sim)
    writer.write()
    sim.frame = 2
    with pytest.raises(ValueError, match="frame 2 cannot follow frame 0"):
        writer.write()


def test_root_path_is_a_directory_or_a_usda_file(tmp_path):
    assert usd.root_path(tmp_path / "a") == tmp_path / "a" / "a.usda"
    assert usd.root_path(tmp_path / "b.usda") == tmp_path / "b.usda"
    with pytest.raises(ValueError, match="directory"):
        usd.root_path(tmp_path / "c.usdc")


def set_surface(stage, name, value, frame):
    stage.GetPrimAtPath("/World/left/surface").GetAttribute(name).Set(value, frame)


def stale_extent(stage):
    set_surface(stage, "extent", [(0, 0, 0), (1, 1, 1)], 2)


def short_primvar(stage):
    set_surface(stage, "primvars:contact:pressure", [1.0, 2.0], 3)


def no_number(stage):
    mesh = UsdGeom.Mesh.Get(stage, "/World/left/surface")
    points = np.array(mesh.GetPointsAttr().Get(1))
    points[3, 1] = np.nan
    mesh.GetPointsAttr().Set(points, 1)


def wrong_index(stage):
    set_surface(stage, "faceVertexIndices", [0, 1, 9999], Usd.TimeCode.Default())
    set_surface(stage, "faceVertexCounts", [3], Usd.TimeCode.Default())


def moving_topology(stage):
    mesh = UsdGeom.Mesh.Get(stage, "/World/left/surface")
    mesh.GetFaceVertexCountsAttr().Set(mesh.GetFaceVertexCountsAttr().Get(), 1)


def inverted_tet(stage):
    attribute = UsdGeom.TetMesh.Get(stage, "/World/left/sim").GetTetVertexIndicesAttr()
    tets = np.array(attribute.Get())
    tets[5] = tets[5][[1, 0, 2, 3]]
    attribute.Set(tets)


def missing_sample(stage):
    stage.GetPrimAtPath("/World/left/surface").GetAttribute("points").ClearAtTime(3)


def wrong_axis(stage):
    UsdGeom.SetStageUpAxis(stage, "Y")


def wrong_rate(stage):
    stage.SetFramesPerSecond(25)


def no_default_prim(stage):
    stage.ClearDefaultPrim()


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (stale_extent, "extent"),
        (short_primvar, "contact:pressure"),
        (no_number, "not finite"),
        (wrong_index, "left/surface"),
        (moving_topology, "time-sampled"),
        (inverted_tet, "inverted"),
        (missing_sample, "samples"),
        (wrong_axis, "upAxis"),
        (wrong_rate, "framesPerSecond"),
        (no_default_prim, "defaultPrim"),
    ],
)
def test_the_check_sees(tmp_path, damage, message):
    stage = copied(written(tmp_path / "run"))
    assert problems(stage) == []
    damage(stage)
    found = problems(stage)
    assert any(message in line for line in found), found


def test_the_check_sees_a_lost_or_torn_frame(tmp_path):
    written(tmp_path / "run")
    frame = tmp_path / "run" / "frames" / "f.000002.usdc"
    whole = frame.read_bytes()
    frame.write_bytes(whole[: len(whole) // 2])
    assert problems(tmp_path / "run") != []
    frame.unlink()
    assert any("samples" in line for line in problems(tmp_path / "run"))


def test_the_check_reports_what_is_no_usd_file(tmp_path):
    (tmp_path / "x.usda").write_text("nothing")
    assert len(problems(tmp_path / "x.usda")) == 1
    assert len(problems(tmp_path / "absent")) == 1


def killed_writer(out: Path, rng: random.Random) -> int:
    """The last frame that a writer finished before it was killed at a random moment."""
    command = [sys.executable, __file__, str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        while process.stdout.readline() != "start\n":
            assert process.poll() is None
        time.sleep(rng.uniform(0.0, 0.5))
        process.send_signal(signal.SIGKILL)
        said = process.stdout.read().split("\n")[:-1]  # without a line that is cut off
    return int(said[-1]) if said else -1


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
def test_a_killed_writer_loses_no_finished_frame(tmp_path):
    seed = int(np.random.SeedSequence().entropy % 2**32)
    print(f"seed {seed}")
    rng, sim = random.Random(seed), FakeSimulation()
    ids = [surface_ids(sim, b) for b in range(2)]
    for kill in range(KILLS):
        out = tmp_path / str(kill)
        finished = killed_writer(out, rng)
        stage = usd.open_stage(out)
        assert stage.GetEndTimeCode() >= finished, kill
        assert problems(stage) == [], kill
        for frame in range(finished + 1):
            points = usd.read_points(stage, frame)
            np.testing.assert_array_equal(points["left"], sim.at(frame)[ids[0]])
            np.testing.assert_array_equal(points["right"], sim.at(frame)[ids[1]])


def write_forever(out: str) -> None:
    """Write frames in a tight loop and say so after each."""
    sim = FakeSimulation()
    writer = usd.UsdWriter(out, sim)
    print("start", flush=True)
    while True:
        writer.write()
        print(sim.frame, flush=True)
        sim.frame += 1


if __name__ == "__main__":
    write_forever(sys.argv[1])
