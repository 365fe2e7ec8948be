"""What the tests of the command line share: a scene file, and what is said of wrong usage."""

from pathlib import Path

BLOCKS = '''"""Two blocks, one above the other.

More words.
"""

import warp_contact as wc

FRAMES = 3
VIEW = {"eye": (1.0, -3.0, 1.5), "target": (0.0, 0.0, 0.5)}
PENALTY = {"stiffness": 1000.0, "damping": 0.1}


def build(gap: float = 0.01, name: str = "upper"):
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    block = wc.box((0.5, 0.5, 0.5), (1, 1, 1))
    stuff = wc.NeoHookean(1e5, 0.3, 1000.0, damping=1e-3)
    scene.add_body(block, stuff, position=(0.0, 0.0, 0.5), label="lower", fixed=True)
    scene.add_body(block, stuff, position=(0.0, 0.0, 1.0 + gap), label=name)
    return scene
'''


def blocks(folder: Path) -> str:
    """The file of a small scene."""
    path = folder / "blocks.py"
    path.write_text(BLOCKS)
    return str(path)


def complaint(capsys) -> str:
    """The one line on stderr."""
    out, err = capsys.readouterr()
    assert out == ""
    assert err.endswith("\n")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    return err
