"""What the documents show runs as it stands there, and README.md is no longer than it may be."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
LINES = 200


def blocks(path: Path) -> list[str]:
    """The Python code of a document."""
    parts = path.read_text(encoding="utf-8").split("```python\n")[1:]
    return [part.split("```")[0] for part in parts]


def test_the_first_page_is_read_in_ten_minutes():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= LINES


def test_the_lines_of_the_first_page_run_one_after_the_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for code in blocks(ROOT / "README.md"):
        exec(compile(code, "README.md", "exec"), names)
    force = names["sim"].forces()
    assert force and (tmp_path / "out" / "press" / "press.usda").is_file()


ALONE = [code for code in blocks(ROOT / "warp_contact" / "README.md") if "wc.Simulation(" in code]


@pytest.mark.parametrize("code", [c for c in ALONE if "wc.sweep(" not in c])
def test_an_example_of_the_package_runs_alone(code):
    exec(compile(code, "warp_contact/README.md", "exec"), {})
