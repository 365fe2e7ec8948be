"""exclusive.py: simulations in several threads, and what a user's terminal shows."""

import subprocess
import sys
import threading

import numpy as np

from warp_contact import NeoHookean, Scene, Simulation, box


def simulation() -> Simulation:
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    for k in range(2):
        scene.add_body(box(0.1, 2), NeoHookean(1e5, 0.3, 1000.0, 1e-3), (0.0, 0.0, 0.05 + 0.11 * k))
    return Simulation(scene)


def run(sim: Simulation, frames: int = 8) -> np.ndarray:
    for _ in sim.frames(frames):
        sim.measure()
    return sim.positions()


def test_simulations_in_threads_give_the_bits_of_one_alone(device):
    alone, found = run(simulation()), []

    def work() -> None:
        found.append(run(simulation()))

    for _ in range(3):  # each round captures anew
        threads = [threading.Thread(target=work) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert len(found) == 9  # none has failed
    for positions in found:
        np.testing.assert_array_equal(positions, alone)


def test_a_script_shows_its_own_lines_and_none_of_the_kernels(tmp_path):
    path = tmp_path / "script.py"
    path.write_text(
        "import warp_contact as wc\n"
        "scene = wc.Scene()\n"
        "scene.add_body(wc.box(0.1, 1), wc.NeoHookean(1e5, 0.3, 1000.0))\n"
        "sim = wc.Simulation(scene)\n"
        "sim.step_frame()\n"
        "sim.measure()\n"
        "print('done')\n"
    )
    out = subprocess.run([sys.executable, path], capture_output=True, text=True, check=True)
    assert "Module" not in out.stdout and out.stdout.splitlines()[-1] == "done"
