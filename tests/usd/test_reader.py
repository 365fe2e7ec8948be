"""usd/reader.py and prims.py: stages and options that make no sense are refused with a reason."""

import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd

from warp_contact.usd import reader
from warp_contact.usd.writer import UsdWriter

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fake_simulation import FakeSimulation, written


def stage_of(first: float, last: float, rate: float = 60.0) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory("a.usda")
    stage.SetStartTimeCode(first)
    stage.SetEndTimeCode(last)
    stage.SetTimeCodesPerSecond(rate)
    return stage


@pytest.mark.parametrize(
    ("first", "last"),
    [(0.0, 1e9), (-1e9, 0.0), (0.0, np.inf), (np.nan, 0.0), (5.0, 1.0), (0.0, 1e308)],
)
def test_frames_without_sense_are_refused_at_once(first, last):
    with pytest.raises(ValueError, match=r"frames go from .*: correct its startTimeCode"):
        reader.frame_numbers(stage_of(first, last))


def test_frames_and_rates_with_sense_are_taken():
    assert reader.frame_numbers(stage_of(-2.0, 3.0)) == range(-2, 4)
    assert reader.frame_rate(stage_of(0.0, 1.0, 24.0)) == 24.0


def test_half_a_body_is_named(tmp_path):
    stage = written(tmp_path / "run", 1)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(stage.Flatten())
    stage = Usd.Stage.Open(layer)
    assert [body.label for body in reader.read_bodies(stage)] == ["left", "right"]
    stage.GetPrimAtPath("/World/left").RemoveProperty("userProperties:label")
    with pytest.raises(ValueError, match="/World/left lacks the number, label or surface"):
        reader.read_bodies(stage)
    stage.ClearDefaultPrim()
    assert reader.read_bodies(stage) == reader.read_planes(stage) == []
    assert reader.read_view(stage) is None


def test_an_error_of_usd_becomes_one_line_that_names_the_file(tmp_path):
    path = tmp_path / "a.usda"
    path.write_text("#usda 1.0\ndef Mesh {")
    with pytest.raises(OSError, match=r"a\.usda is not a readable USD file \(") as caught:
        with reader.usd_errors(path):
            Usd.Stage.Open(str(path))
    assert "\n" not in str(caught.value) and "pxrInternal" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"view": ((1, 1, 1), (1, 1, 1))}, r"eye \[1.0, 1.0, 1.0\]: give another place"),
        ({"view": (1, 1, 1)}, "view .*: give eye and target"),
        ({"view": ((1, 1, 1), (0, 0, np.nan))}, "target .*: give finite numbers"),
        ({"flatten": "no"}, "flatten 'no': give True or False"),
        ({"pressure_scale": -1.0}, "pressure_scale -1.0: give a number above 0"),
    ],
)
def test_options_of_a_writer_that_cannot_work_are_refused_before_anything_is_written(
    options, words, tmp_path
):
    with pytest.raises(ValueError, match=words):
        UsdWriter(tmp_path / "run", FakeSimulation(), **options)
    assert list(tmp_path.iterdir()) == []
