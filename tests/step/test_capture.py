"""What is captured allocates nothing and reads nothing back: a GPU would refuse it."""

import numpy as np
import pytest
import warp as wp

from warp_contact import (
    ContactSurface,
    NeoHookean,
    Penalty,
    PredictedForce,
    Rigid,
    Scene,
    Simulation,
    VirtualSurface,
    box,
)
from warp_contact.frame import buffers, implicit_shapes

RESPONSES = {
    "surface": ContactSurface(),
    "literal": ContactSurface("literal"),
    "penalty": Penalty(1000.0, 0.5),
    "virtual": VirtualSurface(2000.0, 0.5),
    "predicted": PredictedForce(),
}
FORBIDDEN = [
    (wp, "zeros"),
    (wp, "empty"),
    (wp, "full"),
    (wp, "ones"),
    (wp, "clone"),
    (wp, "synchronize"),
    (wp, "zeros_like"),
    (wp, "empty_like"),
    (wp, "synchronize_device"),
    (wp.array, "numpy"),
    (wp.utils, "array_scan"),
    (wp.utils, "array_sum"),
    (wp.utils, "radix_sort_pairs"),
]


def touching(overlap: float, upper=None) -> Scene:
    """Two blocks on a floor, on or in each other."""
    scene = Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    rubber = NeoHookean(5e4, 0.3, 1000.0, 1e-3)
    scene.add_body(box(0.1, 2), rubber, (0.0, 0.0, 0.0501))
    scene.add_body(box(0.1, 3), upper or rubber, (0.01, 0.02, 0.1502 - overlap))
    return scene


@pytest.mark.parametrize("overlap", [0.0, 0.03])
@pytest.mark.parametrize(
    "name",
    [*RESPONSES, "implicit", "rigid", "rigid penalty", "rigid predicted", "mixed", "rigid tied"]
    + ["rigid bouncing", "rigid driven"],
)
def test_nothing_in_a_capture_allocates_or_reads_back(monkeypatch, name, overlap):
    captured = []
    take_steps = buffers.take_steps

    def guarded(*args) -> None:
        def refuse(what: str):
            def refused(*_, **__):
                raise AssertionError(f"{what} within a capture")

            return refused

        with monkeypatch.context() as m:
            for owner, attribute in FORBIDDEN:
                m.setattr(owner, attribute, refuse(attribute))
            take_steps(*args)
        captured.append(args)

    monkeypatch.setattr(buffers, "take_steps", guarded)
    if name == "mixed":
        monkeypatch.setattr(implicit_shapes, "LARGEST", 30)  # the upper block is lumped
    scene = touching(overlap, Rigid(1000.0) if name.startswith("rigid") else None)
    if name == "rigid tied":
        scene.attach(1, kind="ball", at=(0.03, 0.0, 0.2), breaking_force=1e6)
        scene.attach(0, kind="weld", vertices=range(9), stiffness=10.0)
    scene.restitution = 0.5 if name == "rigid bouncing" else 0.0
    if name == "rigid driven":
        scene.attach(1, kind="hinge", at=(0.03, 0.0, 0.2), axis=(1.0, 0.0, 0.0), label="turned")
    integrator = "explicit" if name in RESPONSES else "implicit"
    sim = Simulation(scene, RESPONSES.get(name.removeprefix("rigid ")), integrator=integrator)
    if name == "rigid driven":
        sim.set_motor("turned", 1.0, 1.0)
    if scene.restitution:
        sim.set_velocity(1, (0.0, 0.0, -1.0))
    assert any(sim.contact_fields()["pressure"].any() for _ in sim.frames(2))
    assert captured and np.isfinite(sim.positions()).all()
