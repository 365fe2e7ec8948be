"""scenes/TUNING.md: the figures that it gives are those that come out.

Numbers of steps within a tenth: another version of Warp may round a frequency otherwise.
"""

import re
from pathlib import Path

import numpy as np
import pytest

import warp_contact as wc

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "scenes" / "TUNING.md").read_text(encoding="utf-8")
SIDE = 0.1  # of the block [m]


def stack(n=2, young=1e5, ratio=0.3, mesh=None) -> wc.Scene:
    """The two blocks of the guide."""
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0))
    rubber, block = wc.NeoHookean(young, ratio, 1000.0, 1e-3), mesh or wc.box(SIDE, n)
    scene.add_body(block, rubber, (0.0, 0.0, 0.5 * SIDE + 0.005))
    scene.add_body(block, rubber, (0.01, 0.0, 1.5 * SIDE + 0.01))
    return scene


def steps(integrator="explicit", **block) -> int:
    """Steps of the second frame."""
    sim = wc.Simulation(stack(**block), integrator=integrator)
    for _ in sim.frames(2):
        pass
    return sim.substeps


def row(words: str) -> list[float]:
    """The numbers of a row of a table of the guide."""
    (line,) = re.findall(rf"^\| {re.escape(words)} \|(.*)\|$", TEXT, re.MULTILINE)
    return [float(re.match(r"[\d.e]+", cell.strip())[0]) for cell in line.split("|")]


def listed(pattern: str) -> list[int]:
    """The numbers of a list in the text, written as ``NUMBERS`` in the pattern."""
    pattern = re.escape(pattern).replace("NUMBERS", r"((?:\d+, )+\d+)")
    return [int(n) for n in re.search(pattern, " ".join(TEXT.split()))[1].split(", ")]


def test_explicit_steps_grow_with_the_root_of_the_modulus_and_implicit_ones_do_not():
    moduli = row("Young's modulus [Pa]")
    found = [steps(young=e) for e in moduli]
    assert found == pytest.approx(row("explicit steps a frame"), rel=0.1)
    assert [steps("implicit", young=e) for e in moduli] == row("implicit")


def test_steps_double_with_half_the_edge_and_grow_with_poissons_ratio():
    expected = listed("twice the steps: NUMBERS for 1, 2, 4 cells")
    assert [steps(n=n) for n in (1, 2, 4)] == pytest.approx(expected, rel=0.1)
    expected = listed("NUMBERS for 0.3, 0.45, 0.49, 0.499")
    found = [steps(ratio=ratio) for ratio in (0.3, 0.45, 0.49, 0.499)]
    assert found == pytest.approx(expected, rel=0.1)


def test_one_flat_tet_doubles_the_steps():
    mesh = wc.box(SIDE, 2)
    x = mesh.vertices.copy()
    x[np.linalg.norm(x, axis=1).argmin(), 0] += 0.45 * SIDE
    flat = wc.TetMesh(x, mesh.tets)
    assert f"from {mesh.quality.min():.2f} to {flat.quality.min():.2f} the same block" in TEXT
    assert "takes 23 steps in place of 11" in " ".join(TEXT.split())
    assert [steps(mesh=flat), steps()] == pytest.approx([23, 11], rel=0.1)


@pytest.mark.parametrize("cells", [1, 2])
@pytest.mark.parametrize("ratio", [0.3, 0.49])
def test_a_cantilever_sags_by_what_the_table_says(cells, ratio):
    mesh, scene = wc.box((0.08, 0.02, 0.02), (4 * cells, cells, cells)), wc.Scene()
    held = mesh.vertices[:, 0] < -0.0399
    body = scene.add_body(mesh, wc.NeoHookean(1e5, ratio, 1000.0, 4e-3), fixed=held)
    sim = wc.Simulation(scene, integrator="implicit")
    for _ in sim.frames(90):
        pass
    sag = 1e3 * (body.x - sim.positions())[:, 2].max()
    # At rest to less than half of the last digit.
    assert sag == pytest.approx(row(str(cells))[0 if ratio == 0.3 else 2], abs=0.06)


def test_a_block_that_falls_rises_less_in_implicit_steps():
    part = []
    for integrator in "explicit", "implicit":
        scene = wc.Scene()
        scene.add_plane((0.0, 0.0, 1.0))
        scene.add_body(wc.box(SIDE, 2), wc.NeoHookean(1e5, 0.3, 1000.0), (0.0, 0.0, 0.15))
        sim = wc.Simulation(scene, integrator=integrator)
        height = [sim.positions()[:, 2].mean() for _ in sim.frames(40)]
        part.append((max(height[int(np.argmin(height)) :]) - 0.05) / 0.1)
    # What the block swings when it leaves the floor is left to chance.
    assert part == [pytest.approx(1 / 3, abs=0.05), pytest.approx(1 / 12, abs=0.02)]


def test_the_words_of_errors_are_those_of_the_table():
    soft = wc.NeoHookean(1e5, 0.3, 1000.0)
    with pytest.raises(wc.SimulationError) as raised:
        wc.Simulation(stack(young=1e15, n=4)).step_frame()
    said = [str(raised.value)]
    with pytest.raises(wc.SimulationError) as raised:
        wc.Simulation(stack(), substeps=2).step_frame()
    said.append(str(raised.value))
    scene = wc.Scene()
    scene.add_body(wc.box(SIDE, 10), soft)
    with pytest.raises(ValueError, match="800") as refused:
        wc.Simulation(scene, integrator="implicit")
    said.append(str(refused.value))
    scene = wc.Scene()
    for _ in range(2):
        scene.add_body(wc.box(SIDE, 1), soft)
    with pytest.raises(ValueError, match="place") as refused:
        wc.Simulation(scene)
    said.append(str(refused.value))
    with pytest.raises(ValueError, match="volume") as refused:
        wc.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2, 3]])
    said.append(str(refused.value))
    for words in (
        r"needs \d+ substeps, more than max_substeps",
        r"substeps=2 is too few",
        r"more than 800",
        r"in the same place",
        r"has no volume",
    ):
        assert any(re.search(words, text) for text in said), words
        plain = words.replace(r"\d+", "...").replace("=2", "=...")
        assert plain in TEXT
