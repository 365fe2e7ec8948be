"""Learning by trial in many worlds: how fast a paddle pushes a ball so that it stops at a mark.

All worlds run at once and begin anew after each episode; a search keeps the best quarter of what
it tried (cross-entropy). ``python -m warp_contact.scenes.examples.episodes``
"""

import numpy as np

import warp_contact as wc

WORLDS = 12
FRAMES = 45  # of an episode
PUSH = 12  # frames during which the paddle moves
MARK = 0.25  # where the ball shall be at the end of an episode [m]


def build(worlds: int = WORLDS) -> wc.Scene:
    """A ball and a paddle in each world; bodies of different worlds never touch."""
    scene = wc.Scene(friction=0.5)
    scene.add_plane((0.0, 0.0, 1.0))
    rubber = wc.NeoHookean(1e5, 0.4, 1000.0, damping=1e-3)
    ball, paddle = wc.sphere(0.04, 41), wc.box((0.02, 0.1, 0.08), (1, 2, 2))
    for k in range(worlds):
        place = (-0.055, 0.0, 0.045)
        scene.add_body(ball, rubber, (0.0, 0.0, 0.04), label=f"ball{k}", world=k)
        scene.add_body(paddle, rubber, place, fixed=True, label=f"paddle{k}", world=k)
    return scene


def episode(sim: wc.Simulation, speeds: np.ndarray) -> np.ndarray:
    """How far each ball ends from the mark [m], for the speed of each paddle [m/s]."""
    sim.reset()
    for k, speed in enumerate(speeds):
        sim.set_velocity(f"paddle{k}", (speed, 0.0, 0.0))
    for frame in sim.frames(FRAMES):
        if frame == PUSH:
            for k in range(len(speeds)):
                sim.set_velocity(f"paddle{k}", (0.0, 0.0, 0.0))
    ends = [sim.positions(f"ball{k}")[:, 0].mean() for k in range(len(speeds))]
    return np.abs(np.array(ends) - MARK)


def main(episodes: int = 5, worlds: int = WORLDS) -> list[float]:
    """The best distance from the mark [m] in each episode."""
    rng, sim, best = np.random.default_rng(1), wc.Simulation(build(worlds)), []
    middle, width = 0.5, 0.3  # of the speeds that are tried [m/s]
    for number in range(episodes):
        speeds = rng.normal(middle, width, worlds).clip(0.05, 1.5)
        missed = episode(sim, speeds)
        chosen = speeds[np.argsort(missed)[: max(2, worlds // 4)]]
        middle, width = chosen.mean(), chosen.std() + 0.01
        best.append(float(missed.min()))
        print(f"episode {number}: {1e3 * best[-1]:.1f} mm off, at {middle:.3f} m/s")
    return best


if __name__ == "__main__":
    main()
