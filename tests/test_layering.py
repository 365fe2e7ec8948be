"""What each room may import, no circle, and the rules of a kernel's signature, read as text."""

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
    "progress": set(),
    "data": {"kernels"},
    "scene": {"kernels", "data"},
    "step": {"kernels", "data"},
    "frame": {"kernels", "data", "step", "errors"},
    "measure": {"kernels", "data", "scene", "step"},
    "usd": set(),
    "picture": {"kernels", "usd"},
    "simulation": {"data", "scene", "step", "frame", "measure", "errors", "progress"},
    "__init__": {"scene", "step", "measure", "usd", "simulation", "errors"},
    "command": {"__init__", "errors", "progress", "scene", "step", "simulation", "usd", "picture"},
    "__main__": {"command"},
}
LADDER = (  # of the kernel rooms: each may import those before it
    {"options"},
    {"geometry", "sorting"},
    {"elastic"},
    {"motion"},
    {"broad_phase"},
    {"narrow_phase"},
    {"impulse"},
    {"surface"},
    {"output"},
)
RUNG = {room: rung for rung, rooms in enumerate(LADDER) for room in rooms}
ONLY_IN = {  # packages that the solver does without
    "pxr": {"scene/mesh", "usd", "picture/render"},
    "PIL": {"picture/files"},
    "meshio": {"scene/mesh"},
    "matplotlib": set(),
}
SECTIONS = ("in", "in, out", "out", "out, added to")


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


def is_warp(node: ast.AST, name: str) -> bool:
    return isinstance(node, ast.Attribute) and ast.unparse(node) == f"wp.{name}"


def functions(path: Path, decorator: str) -> list[ast.FunctionDef]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [
        node
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
        and any(is_warp(d, decorator) for d in node.decorator_list)
    ]


FUNCS = {node.name: node for path in KERNELS for node in functions(path, "func")}
CASES = [
    pytest.param(path, kernel, id=f"{path.stem}-{kernel.name}")
    for path in KERNELS
    for kernel in functions(path, "kernel")
]


def written(function: ast.FunctionDef) -> set[str]:
    """Arguments that a kernel or function stores into, by itself, by atomics or through others."""
    names = set()
    for node in ast.walk(function):
        if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store):
            names.add(ast.unparse(node.value))
        elif isinstance(node, ast.Call) and node.args:
            name = ast.unparse(node.func).split(".")[-1]
            if name.startswith("atomic_"):
                names.add(ast.unparse(node.args[0]))
            elif name in FUNCS:
                called = FUNCS[name]
                into = written(called)
                for argument, value in zip(called.args.args, node.args, strict=False):
                    if argument.arg in into:
                        names.add(ast.unparse(value))
    return names & {argument.arg for argument in function.args.args}


def sections(path: Path, kernel: ast.FunctionDef) -> dict[str, str]:
    """Section of each argument: the last comment line of its own above it."""
    lines = path.read_text(encoding="utf-8").splitlines()
    section, found = "", {}
    arguments = {argument.lineno: argument.arg for argument in kernel.args.args}
    for number in range(kernel.lineno, kernel.body[0].lineno):
        text = lines[number - 1].strip()
        if text.startswith("# "):
            section = text[2:]
        if number in arguments:
            found[arguments[number]] = section
    return found


def is_array(argument: ast.arg) -> bool:
    return argument.annotation is not None and "wp.array" in ast.unparse(argument.annotation)


def test_there_are_kernels_to_check():
    assert len(CASES) > 30


@pytest.mark.parametrize(("path", "kernel"), CASES)
def test_every_array_of_a_kernel_has_its_shape_in_a_comment(path, kernel):
    lines = path.read_text(encoding="utf-8").splitlines()
    arrays = [argument for argument in kernel.args.args if is_array(argument)]
    bare = [a.arg for a in arrays if "  # " not in lines[a.lineno - 1]]
    assert bare == []
    assert not any("dtype=" in ast.unparse(a.annotation) for a in arrays)


@pytest.mark.parametrize(("path", "kernel"), CASES)
def test_a_kernel_lists_its_arguments_in_sections_and_keeps_to_them(path, kernel):
    section = sections(path, kernel)
    stored = written(kernel)
    assert list(section) == [argument.arg for argument in kernel.args.args]
    assert set(section.values()) <= set(SECTIONS)
    assert {"out", "in, out", "out, added to"} & set(section.values())
    assert {name for name in stored if section[name] == "in"} == set()
    assert {name for name, s in section.items() if s != "in"} - stored == set()


@pytest.mark.parametrize(("path", "kernel"), CASES)
def test_a_kernel_says_what_a_thread_is(path, kernel):
    of_many = any(argument.arg == "threads" for argument in kernel.args.args)
    start = "For each" if of_many else "One thread"  # launch.py
    assert (ast.get_docstring(kernel) or "").startswith(start)


def called(node: ast.AST) -> set[str]:
    """Names of the functions that are called within a piece of source."""
    calls = [n.func for n in ast.walk(node) if isinstance(n, ast.Call)]
    return {f.attr if isinstance(f, ast.Attribute) else getattr(f, "id", "") for f in calls}


def test_no_query_begins_before_another_has_ended():
    """On a GPU all queries of a thread share one stack."""
    functions = {
        node.name: node
        for path in KERNELS
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef)
    }
    begin = {"bvh_query_aabb", "bvh_query_ray"}
    asking: set[str] = set()
    while True:  # those that ask, and those that call them
        more = {name for name, node in functions.items() if called(node) & (begin | asking)}
        if more == asking:
            break
        asking = more
    assert {"first_hit", "closest_hit", "visit_edges"} <= asking
    loops = 0
    for name, node in functions.items():
        for loop in (n for n in ast.walk(node) if isinstance(n, ast.While)):
            if "bvh_query_next" in called(loop.test):
                loops += 1
                inside = set().union(*(called(statement) for statement in loop.body))
                assert not inside & (begin | asking), name
    assert loops > 5
