"""The import ladder, and the rules of a kernel's signature, read from the source files."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "warp_contact"
KERNELS = sorted((ROOT / "kernels").glob("*.py"))
SCENES = sorted((ROOT / "scenes").glob("*.py"))

LADDER = (  # a module imports from lower rungs only
    {"kernels"},
    {"topology", "errors", "progress", "response", "types", "usd_scene"}
    | {"pictures", "launch", "warm"},
    {"mesh", "materials", "work", "forces", "usd", "checkpoint", "raycast", "diagnosis", "ready"},
    {"shapes", "scene", "candidates", "depth", "impulse", "spectrum", "measure", "usd_check"}
    | {"rest", "fields", "placement", "room"},
    {"assemble", "detect", "surface", "render", "scenes", "substeps"},
    {"solver", "pace"},
    {"stepper"},
    {"simulation"},
    {"__init__", "commands", "runs"},
    {"cli"},
    {"__main__"},
)
RUNG = {name: rung for rung, names in enumerate(LADDER) for name in names}
SCENES_MAY = {"scene", "shapes", "materials", "mesh", "topology"}
ONLY_IN = {  # packages that the solver does without
    "pxr": {"mesh", "usd_scene", "usd", "usd_check", "render"},
    "PIL": {"pictures"},
    "meshio": {"mesh"},
    "matplotlib": set(),
}
SECTIONS = ("in", "in, out", "out", "out, added to")


def imports(path: Path) -> set[str]:
    """Absolute names; of ``from warp_contact import x`` that of x when x is a module."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: imports are absolute"
            if node.module == "warp_contact":
                found |= {f"warp_contact.{a.name}" for a in node.names if a.name in RUNG}
            else:
                found.add(node.module)
    return found


def inner(path: Path) -> set[str]:
    """Modules of this package that a file imports."""
    return {name.split(".")[1] for name in imports(path) if name.startswith("warp_contact.")}


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("*.py")), ids=lambda p: p.stem)
def test_a_module_imports_from_lower_rungs_only(path):
    assert path.stem in RUNG, f"give {path.name} a rung on the ladder"
    assert {name for name in inner(path) if RUNG[name] >= RUNG[path.stem]} == set()


@pytest.mark.parametrize("path", SCENES, ids=lambda p: p.stem)
def test_a_scene_knows_shapes_and_materials_but_no_solver(path):
    assert inner(path) <= SCENES_MAY


@pytest.mark.parametrize("path", KERNELS, ids=lambda p: p.stem)
def test_a_kernel_file_imports_warp_and_kernel_files_only(path):
    others = {n for n in imports(path) if n != "warp" and not n.startswith("warp_contact.kernels")}
    assert others == set()


@pytest.mark.parametrize("package", ONLY_IN)
def test_an_optional_package_stays_in_its_place(package):
    files = [*PACKAGE.glob("*.py"), *KERNELS, *SCENES]
    users = {p.stem for p in files if package in {n.split(".")[0] for n in imports(p)}}
    assert users <= ONLY_IN[package]


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
