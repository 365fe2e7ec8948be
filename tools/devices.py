"""Whether the scenes of the paper begin on a device as they do on the CPU.

    python tools/devices.py [DEVICE]

``apart`` is the largest distance between a vertex and the same vertex of the CPU's run after four
frames, in lengths of the scene. The CPU's run rounds each product and each sum by itself. So
``devices.py cpu`` says how far roundings alone carry a scene.
"""

import sys
from functools import partial

import numpy as np
import warp as wp
from fingerprint import round_each_operation
from measure import machine, report
from measure.figure import Figure, Figures
from measure.run import command_line, run, status

import warp_contact as wc
from warp_contact import scenes

FRAMES = 4
APART = 1e-3  # three times what roundings alone do, 3.3e-4 in two_bodies


def positions(name: str, device: str) -> np.ndarray:
    """Vertices after the first frames [m]."""
    sim = wc.Simulation(scenes.load(name).build(), device=device)
    for _ in sim.frames(FRAMES):
        pass
    return np.concatenate([sim.positions(body) for body in range(len(sim.scene.bodies))])


def compare(name: str, ours: np.ndarray) -> Figures:
    """The positions of a scene against those on the CPU."""
    theirs = positions(name, "cpu")
    apart = np.linalg.norm(ours - theirs, axis=1).max() / np.ptp(theirs, axis=0).max()
    yield Figure(name, "apart [of the scene]", float(apart), most=APART)


def main() -> int:
    """Print a figure for each scene; 1 where one is too far from the CPU's."""
    parser = command_line(__doc__)
    parser.add_argument("device", nargs="?", help="as Warp names it, or its default")
    device = str(wp.get_device(parser.parse_args().device))
    print(machine.line(device), "", report.FIGURES.head(), sep="\n")
    found = {name: positions(name, device) for name in scenes.names()}
    round_each_operation()
    return status(run({name: partial(compare, name, ours) for name, ours in found.items()}))


if __name__ == "__main__":
    sys.exit(main())
