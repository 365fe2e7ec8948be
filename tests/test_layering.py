"""What each room may import, no circle, and how long files and functions may be."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "warp_contact"
HOST = sorted(p for p in PACKAGE.rglob("*.py") if not {"kernels", "scenes"} & {*p.parts})
KERNELS = sorted((ROOT / "kernels").rglob("*.py"))
SCENES = sorted((ROOT / "scenes").glob("*.py"))

MAY = {  # room: those that it may import, beside itself
    "errors": set(),
    "files": set(),
    "interrupts": set(),
    "progress": set(),
    "exclusive": set(),
    "checks": set(),
    "data": {"kernels"},
    "scene": {"kernels", "data", "checks"},
    "step": {"kernels", "data", "checks"},
    "frame": {"kernels", "data", "step", "errors", "files"},
    "measure": {"kernels", "data", "scene", "step"},
    "usd": {"checks", "files"},
    "picture": {"kernels", "usd", "checks"},
    "between_frames": {"data", "scene", "frame", "measure", "exclusive", "checks"},
    "contact_data": {"data", "scene", "frame", "measure", "exclusive"},
    "joined": {"data", "scene", "frame", "exclusive", "checks"},
    "simulation": {"data", "scene", "step", "frame", "measure", "between_frames"}
    | {"contact_data", "joined", "errors", "progress", "exclusive", "checks"},
    "runs": {"checks", "files", "usd"},
    "__init__": {"scene", "step", "measure", "usd", "simulation", "errors", "interrupts"}
    | {"runs"},
    "newton": {"__init__", "scene", "checks"},
    "command": {"__init__", "errors", "files", "interrupts", "progress", "scene", "step"}
    | {"simulation", "usd", "picture", "checks"},
    "__main__": {"command"},
}
LADDER = (  # of the kernel rooms: each may import those before it
    {"options"},
    {"geometry", "lengths", "mesh", "mobility", "scan", "sorting", "worlds"},
    {"elastic"},
    {"motion"},
    {"implicit"},
    {"broad_phase"},
    {"narrow_phase"},
    {"impulse"},
    {"ties"},
    {"surface"},
    {"output"},
)
RUNG = {room: rung for rung, rooms in enumerate(LADDER) for room in rooms}
ONLY_IN = {  # packages that the solver does without
    "pxr": {"scene/files", "scene/reading", "scene/reading_faces", "usd", "picture"}
    | {
        f"scene/reading_{part}"
        for part in ("attachments", "others", "scene", "stage", "surroundings")
    },
    "PIL": {"picture/files"},
    "imageio_ffmpeg": {"picture/files"},
    "meshio": {"scene/files", "scene/reading", "scene/reading_faces"},
    "matplotlib": {"picture/plot"},
    "newton": {"newton"},
    "viser": {"picture/viewer"},
}
# Folders whose files and functions are short.
SIZED = ("warp_contact", "kernels", "scenes", "tests", "tools")
LINES = 300  # of a file
FUNCTION = 45  # lines of a host function, with its docstring


def name_of(path: Path) -> str:
    """The name by which a file is imported."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    parts = parts if parts[0] == "warp_contact" else ("warp_contact", *parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" and len(parts) > 2 else parts)


NAMES = {name_of(path) for path in (*HOST, *KERNELS, *SCENES)}


def imports(path: Path) -> set[str]:
    """Absolute names; of ``from a import b`` that of b when it is a module."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: imports are absolute"
            full = {f"{node.module}.{alias.name}" for alias in node.names}
            modules = full & NAMES
            found |= modules
            if modules != full:
                root = node.module == "warp_contact"
                found.add("warp_contact.__init__" if root else node.module)
    return found


def inner(path: Path) -> set[str]:
    """Modules of this package that a file imports."""
    return {name for name in imports(path) if name.startswith("warp_contact.")}


def room(name: str, depth: int = 1) -> str:
    return name.split(".")[depth]


@pytest.mark.parametrize("path", HOST, ids=name_of)
def test_a_room_imports_only_what_it_may(path):
    own = room(name_of(path))
    assert own in MAY, f"give {path.name} a room"
    assert {room(name) for name in inner(path)} - MAY[own] - {own} == set()


@pytest.mark.parametrize("path", KERNELS, ids=name_of)
def test_a_kernel_room_imports_from_lower_rungs_only(path):
    if path.parent.name == "kernels" and path.stem == "__init__":
        return
    own = room(name_of(path), 2)
    higher = {n for n in inner(path) if room(n, 2) != own and RUNG[room(n, 2)] >= RUNG[own]}
    assert higher == set()


def test_no_imports_run_in_a_circle():
    graph = {name_of(path): inner(path) for path in (*HOST, *KERNELS, *SCENES)}
    list(TopologicalSorter(graph).static_order())  # raises CycleError


@pytest.mark.parametrize("path", SCENES, ids=lambda p: p.stem)
def test_a_scene_knows_shapes_and_materials_but_no_solver(path):
    assert {room(name) for name in inner(path)} <= {"scene"}


@pytest.mark.parametrize("path", KERNELS, ids=name_of)
def test_a_kernel_file_imports_warp_and_kernel_files_only(path):
    others = {n for n in imports(path) if n != "warp" and not n.startswith("warp_contact.kernels")}
    assert others == set()


@pytest.mark.parametrize("package", ONLY_IN)
def test_an_optional_package_stays_in_its_place(package):
    users = set()
    for path in (*HOST, *KERNELS, *SCENES):
        if package in {name.split(".")[0] for name in imports(path)}:
            users.add(
                path.relative_to(PACKAGE if path in HOST else ROOT).with_suffix("").as_posix()
            )
    allowed = ONLY_IN[package]
    assert {u for u in users if u not in allowed and u.split("/")[0] not in allowed} == set()


def sized() -> list[Path]:
    """Python files of the folders ``SIZED``, each once; two are links in the package."""
    found = [path for folder in SIZED for path in sorted((ROOT / folder).rglob("*.py"))]
    return [path for path in found if path == path.resolve()]


def test_no_file_is_long():
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in sized()}
    assert len(lines) > 100
    assert {path.relative_to(ROOT): n for path, n in lines.items() if n > LINES} == {}


def test_no_function_of_the_host_is_long():
    long = set()
    for path in sized():
        if not path.is_relative_to(ROOT / "kernels"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.FunctionDef) and node.end_lineno - node.lineno >= FUNCTION:
                    long.add(f"{path.relative_to(ROOT).as_posix()}: {node.name}")
    assert long == set()
