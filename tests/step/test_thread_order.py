"""What threads do in another order gives the same bits: on a GPU they race."""

import numpy as np
import pytest

from warp_contact import (
    ContactSurface,
    NeoHookean,
    Penalty,
    PredictedForce,
    Scene,
    Simulation,
    VirtualSurface,
    box,
    sphere,
)
from warp_contact.data import launch, scan

SOFT = NeoHookean(5e4, 0.35, 1000.0, 1e-3)


def heap(inside: float) -> Scene:
    """Bodies on each other and on a floor, one of them in another to begin with."""
    scene = Scene(friction=0.4)
    scene.add_plane((0.0, 0.05, 1.0), 0.0)
    scene.add_body(box(0.1, 3), SOFT, (0.0, 0.0, 0.055))
    scene.add_body(box(0.1, 5), SOFT, (0.03, 0.02, 0.159 - inside), (0.0, 0.0, 0.3, 0.954))
    scene.add_body(sphere(0.04, 41), SOFT, (-0.05, 0.01, 0.15), velocity=(0.5, 0.0, -1.0))
    return scene


def bits(scene: Scene, response) -> list[bytes]:
    """Of what a user reads, after each frame."""
    sim, found, touched = Simulation(scene, response), [], False
    for _ in sim.frames(4):
        fields = sim.contact_fields()
        touched = touched or fields["pressure"].any()
        found += [sim.positions().tobytes(), sim.velocities().tobytes()]
        found += [np.ascontiguousarray(field).tobytes() for field in fields.values()]
        found.append(repr(sorted(sim.measure().forces.items())).encode())
    assert touched
    return found


@pytest.mark.parametrize(
    ("response", "inside"),
    [
        pytest.param(ContactSurface(), 0.0, id="surface"),
        pytest.param(ContactSurface(), 0.06, id="surface inside"),
        pytest.param(ContactSurface("literal"), 0.06, id="literal inside"),
        pytest.param(Penalty(2e3, 0.5), 0.06, id="penalty inside"),
        pytest.param(VirtualSurface(4e3, 0.5), 0.06, id="virtual inside"),
        pytest.param(PredictedForce(), 0.0, id="predicted"),
    ],
)
def test_the_threads_that_share_a_list_may_take_it_in_any_order(monkeypatch, response, inside):
    expected = bits(heap(inside), response)
    for threads in (5, 10**9):
        monkeypatch.setattr(launch, "ON_CPU", threads)
        assert bits(heap(inside), response) == expected


def test_sums_in_chunks_lead_to_the_same_bits(monkeypatch):
    expected = bits(heap(0.0), ContactSurface())

    def scan_as_on_a_gpu(values, scratch, inclusive):
        scan._scan_in_chunks(values, scratch, inclusive, scan.CHUNK)

    for module in ("broad_phase", "narrow_phase", "contact_graph"):
        monkeypatch.setattr(f"warp_contact.step.{module}.scan", scan_as_on_a_gpu)
    assert bits(heap(0.0), ContactSurface()) == expected
