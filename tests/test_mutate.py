"""tools/mutate.py: its list fits the tree, and it tells what is caught from what is not."""

import ast
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

import mutate
from mutate import ROOT


def test_every_change_has_one_place_and_leaves_code():
    for change in mutate.changes():
        text = (ROOT / change["file"]).read_text(encoding="utf-8")
        assert text.count(change["old"]) == 1, change
        assert change["old"] != change["new"], change
        ast.parse(text.replace(change["old"], change["new"]))


def test_every_test_that_is_to_notice_is_there():
    for change in mutate.changes():
        path, _, name = change["test"].partition("::")
        tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
        names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        assert not name or name.partition("[")[0] in names, change


def test_the_changes_are_many_and_of_kernels_and_host():
    changes = mutate.changes()
    assert len({(c["file"], c["old"], c["new"]) for c in changes}) == len(changes) >= 60
    of_kernels = [c for c in changes if c["file"].startswith("kernels/")]
    assert 0.4 < len(of_kernels) / len(changes) < 0.8


@pytest.fixture
def tree(tmp_path) -> Path:
    """A function with a test that asks what it returns, and one that only calls it."""
    (tmp_path / "code_of_it.py").write_text("def doubled(x):\n    return 2 * x\n")
    test = "from code_of_it import doubled\ndef test_exact():\n    assert doubled(3) == 6\n"
    test += "def test_weak():\n    doubled(3)\n"
    (tmp_path / "test_it.py").write_text(test)
    return tmp_path


@pytest.mark.parametrize(("test", "caught"), [("test_exact", True), ("test_weak", False)])
def test_a_change_is_caught_where_its_test_fails_and_is_then_taken_back(tree, test, caught):
    change = {
        "file": "code_of_it.py",
        "old": "2 * x",
        "new": "3 * x",
        "test": f"test_it.py::{test}",
    }
    before = (tree / "code_of_it.py").read_text()
    assert mutate.passes(tree, change["test"])
    assert mutate.catches(tree, change) == caught
    assert (tree / "code_of_it.py").read_text() == before


def test_a_change_without_its_place_and_a_test_that_is_not_there_are_errors(tree):
    change = {"file": "code_of_it.py", "old": "2 + x", "new": "3", "test": "test_it.py::test_exact"}
    with pytest.raises(ValueError, match=r"code_of_it\.py has 0 times '2 \+ x'"):
        mutate.catches(tree, change)
    with pytest.raises(RuntimeError, match="test_gone"):
        mutate.passes(tree, "test_it.py::test_gone")
