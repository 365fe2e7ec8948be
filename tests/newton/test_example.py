"""One of Newton's own examples of soft bodies with our solver: one line of it is another one."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

newton = pytest.importorskip("newton", "1.8")
examples = pytest.importorskip("newton.examples")

LINE = "self.solver = SolverSemiImplicit(model=self.model)"
OURS = "import warp_contact.newton as w; self.solver = w.SolverContactSurface(model=self.model)"
STEPS = 4  # of the 32 of a frame


def test_an_example_of_newton_runs_by_changing_one_line(device, tmp_path, monkeypatch):
    folder = Path(examples.__file__).parent / "multiphysics"
    source = (folder / "example_rigid_soft_contact.py").read_text(encoding="utf-8")
    assert source.count(LINE) == 1
    (tmp_path / "changed.py").write_text(source.replace(LINE, OURS), encoding="utf-8")
    spec = importlib.util.spec_from_file_location("changed", tmp_path / "changed.py")
    changed = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(changed)
    if device.is_cuda:  # where it is captured: another line
        monkeypatch.setattr(changed.Example, "capture", lambda self: setattr(self, "graph", None))
    parser = changed.Example.create_parser()
    args = examples.default_args(parser)
    args.solver = "semi_implicit"
    example = changed.Example(newton.viewer.ViewerNull(num_frames=1), args)
    example.sim_substeps = STEPS
    before = example.state_0.body_q.numpy()[0, 2]
    example.step()
    fallen = before - example.state_0.body_q.numpy()[0, 2]
    time = STEPS * example.sim_dt
    assert fallen == pytest.approx(0.5 * 9.81 * time**2, rel=0.05)  # 2.5 is rounded by 1e-7
    assert np.isfinite(example.state_0.particle_q.numpy()).all()
    example.test_final()
