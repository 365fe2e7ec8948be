"""The rules of a kernel's arguments and of the fields of a structure, read as text."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
KERNELS = sorted((ROOT / "kernels").rglob("*.py"))
SECTIONS = ("in", "in, out", "out", "out, added to")
ARGUMENTS = 10  # of a kernel
WIDE = 14  # kernels that may have more
SUMS = "wp.atomic_add", "wp.atomic_sub"


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


def root(node: ast.AST) -> str:
    """The variable that a piece of it belongs to: ``a`` of ``a``, ``a[i].b`` and ``a.b[i]``."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return ast.unparse(node)


def is_store(node: ast.AST) -> bool:
    """Whether it is the target of a store into an array, or into a field of an element of one."""
    if not isinstance(getattr(node, "ctx", None), ast.Store):
        return False
    while isinstance(node, ast.Attribute):
        node = node.value
    return isinstance(node, ast.Subscript)


def written(function: ast.FunctionDef) -> set[str]:
    """Arguments that a kernel or function stores into, by itself, by atomics or through others."""
    names = set()
    for node in ast.walk(function):
        if is_store(node):
            names.add(root(node))
        elif isinstance(node, ast.Call) and node.args:
            name = ast.unparse(node.func).split(".")[-1]
            if name.startswith("atomic_"):
                names.add(root(node.args[0]))
            elif name in FUNCS:
                called = FUNCS[name]
                into = written(called)
                for argument, value in zip(called.args.args, node.args, strict=False):
                    if argument.arg in into:
                        names.add(root(value))
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


@pytest.mark.parametrize(
    "statement",
    [
        "a[i] = 1.0",
        "a[i] += 1.0",
        "a[i].depth = 1.0",
        "a[i].at.depth -= 1.0",
        "a[i].direction[2] = 1.0",
        "a.list[i] = 1.0",
        "a.list[i].depth = 1.0",
        "a[i], j = b[i], i",
        "wp.atomic_add(a, i, 1.0)",
        "wp.atomic_max(a.list, i, 1.0)",
        "sort(a, 0, i)",
        "sort(a.list, 0, i)",
    ],
)
def test_every_kind_of_store_is_seen(statement):
    function = ast.parse(f"def kernel(a, b, i):\n    {statement}").body[0]
    assert written(function) == {"a"}


@pytest.mark.parametrize("statement", ["b = a[i].depth", "b = a", "c = A()\n    c.depth = a[i]"])
def test_what_is_read_is_not_taken_for_a_store(statement):
    function = ast.parse(f"def kernel(a, i):\n    {statement}").body[0]
    assert written(function) == set()


def test_few_kernels_have_many_arguments():
    wide = [p.id for p in CASES if len(p.values[1].args.args) > ARGUMENTS]
    assert len(wide) <= WIDE, wide


def structures(path: Path) -> list[ast.ClassDef]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [
        node
        for node in tree.body
        if isinstance(node, ast.ClassDef) and any(is_warp(d, "struct") for d in node.decorator_list)
    ]


def test_every_array_of_a_structure_has_its_shape_in_a_comment():
    """Or the docstring of the structure has that of all of them."""
    bare, seen = set(), 0
    for path in KERNELS:
        lines = path.read_text(encoding="utf-8").splitlines()
        for structure in structures(path):
            in_all = "have the shape (" in (ast.get_docstring(structure) or "")
            for field in structure.body:
                if isinstance(field, ast.AnnAssign) and "wp.array" in ast.unparse(field.annotation):
                    seen += 1
                    assert "dtype=" not in ast.unparse(field.annotation)
                    _, _, comment = lines[field.lineno - 1].partition("  # ")
                    if not comment.startswith("(") and not (in_all and comment):
                        bare.add(f"{structure.name}.{field.target.id}")
    assert seen > 20
    assert bare == set()


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


def test_only_integers_are_summed_by_atomics():
    """Threads race: a sum of floats in another order has other bits."""
    summed = set()
    for path in KERNELS:
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef):
                kinds = {a.arg: ast.unparse(a.annotation) for a in function.args.args}
                for node in ast.walk(function):
                    if isinstance(node, ast.Call) and ast.unparse(node.func) in SUMS:
                        summed.add(kinds[root(node.args[0])])
    assert summed == {"wp.array[int]", "wp.array[wp.int64]", "wp.array2d[wp.int64]"}
