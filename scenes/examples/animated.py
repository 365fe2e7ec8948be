"""An animated collider: a skin whose vertices are given for each frame throws up a block.

Its middle rises by h (1 - cos w t) / 2. The block takes off where that slows down by g.
``python -m warp_contact.scenes.examples.animated``
"""

import numpy as np

import warp_contact as wc

FPS = 240
HEIGHT, W = 0.08, 2.0 * np.pi / 0.3  # h [m], w [1/s]
WIDTH, CELLS = 0.4, 16  # of the skin [m]
THICK = 0.02  # of the shell below it: as thick as the place allows [m]
EDGE = 0.06  # of the block [m]
COSINE = -9.81 / (0.5 * HEIGHT * W**2)  # cos w t where it takes off
SPEED = 0.5 * HEIGHT * W * np.sqrt(1.0 - COSINE**2)  # with which it does [m/s]
APEX = 0.5 * HEIGHT * (1.0 - COSINE) + SPEED**2 / (2.0 * 9.81)  # to which it flies [m]


def skin() -> wc.Surface:
    """A square that faces upwards; of a file of yours ``wc.Surface.load``."""
    x, y = (np.indices((CELLS + 1, CELLS + 1)).reshape(2, -1) / CELLS - 0.5) * WIDTH
    a = np.arange(CELLS * (CELLS + 1)).reshape(CELLS, -1)[:, :-1].ravel()
    b, c, d = a + CELLS + 1, a + CELLS + 2, a + 1
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return wc.Surface(np.stack([x, y, 0.0 * x], axis=1), triangles)


def motion(surface: wc.Surface, frames: int) -> np.ndarray:
    """Its vertices at each frame [m], (frames + 1, n, 3), as ``Surface.load_frames`` has them."""
    up = 0.5 * HEIGHT * (1.0 - np.cos(W * np.arange(frames + 1) / FPS))
    bulge = np.exp(-((np.linalg.norm(surface.vertices, axis=1) / (0.35 * WIDTH)) ** 4))
    return surface.vertices + (up[:, None] * bulge)[:, :, None] * (0.0, 0.0, 1.0)


def build() -> wc.Scene:
    """All vertices of the shell are fixed: they go where they are told to, and take along."""
    scene = wc.Scene(friction=0.5)
    rubber = wc.NeoHookean(2e5, 0.3, 1000.0, damping=2e-3)
    shell = wc.shell(skin(), THICK, side="inside")
    scene.add_body(shell, rubber, fixed=True, label="skin")
    scene.add_body(wc.box(EDGE, 2), rubber, (0.0, 0.0, EDGE / 2), label="block")
    return scene


def main(frames: int = 60) -> list[float]:
    """Height of the middle of the block [m] after each frame, above where it stood."""
    sim, surface, heights = wc.Simulation(build(), fps=FPS), skin(), []
    for x in motion(surface, frames)[1:]:
        sim.move_to("skin", wc.shell(surface.moved(x), THICK, side="inside").vertices)
        sim.step_frame()
        heights.append(float(sim.positions("block")[:, 2].mean()) - EDGE / 2)
    print(f"the block rises by {max(heights):.4f} m; closed form {APEX:.4f} m")
    return heights


if __name__ == "__main__":
    main()
