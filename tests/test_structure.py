"""The shape of the source: its rooms, who imports whom, who owns what, and unique class names.

Read from the files alone, without an import of the package. The rooms and their order are those of
the contracts in ``pyproject.toml``, which ``lint-imports`` holds the package to as well.
"""

import ast
import tomllib
from collections import defaultdict
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

PROJECT = Path(__file__).parents[1]
PACKAGE = "fire_atlas"

OWNERS = {
    "cv2.DISOpticalFlow.create": "vision.flow",
    "cv2.calcOpticalFlowFarneback": "vision.flow",
    "cv2.remap": "vision.warp",
    "bytes.fromhex": "core.pixels",
    "np.random.Generator": "core.chance",
    "hashlib.file_digest": "outputs.digest",
}
"""The one module that calls each of these: the owner of what is computed by it."""


class Taken(NamedTuple):
    """A name that a module imports from another one, under its own name for it."""

    module: str
    name: str
    alias: str


@cache
def modules() -> dict[str, ast.Module]:
    """Return every module of the package by its dotted name."""
    found = {}
    for path in sorted((PROJECT / PACKAGE).rglob("*.py")):
        name = ".".join(path.relative_to(PROJECT).with_suffix("").parts)
        found[name.removesuffix(".__init__")] = ast.parse(path.read_text(encoding="utf-8"))
    return found


@cache
def taken_by(module: str) -> list[Taken]:
    """Return what a module imports from the project, at its top or inside its functions."""
    return [
        Taken(node.module, alias.name, alias.asname or alias.name)
        for node in ast.walk(modules()[module])
        if isinstance(node, ast.ImportFrom) and node.module and is_own(node.module)
        for alias in node.names
    ]


def is_own(module: str) -> bool:
    """Return whether a module is one of the project."""
    return module.split(".")[0] == PACKAGE


def origin(module: str, name: str) -> str:
    """Return the module that ``name``, imported from ``module``, comes from."""
    if f"{module}.{name}" in modules():
        return f"{module}.{name}"
    passed_on = [each for each in taken_by(module) if each.alias == name]
    return origin(passed_on[0].module, passed_on[0].name) if passed_on else module


@cache
def imports() -> dict[str, set[str]]:
    """Return which modules each module imports."""
    return {
        module: {origin(each.module, each.name) for each in taken_by(module)} - {module}
        for module in modules()
    }


@cache
def floors() -> dict[str, tuple[int, ...]]:
    """Return on which floor each room of the contracts is, counted from the top.

    A room within a room is on a floor of the house, and on one of those between.
    """
    contracts = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))
    floor = {
        f"{container}.{room.strip()}": number
        for contract in contracts["tool"]["importlinter"]["contracts"]
        if contract["type"] == "layers"
        for container in contract["containers"]
        for number, layer in enumerate(contract["layers"])
        for room in layer.split("|")
    }

    def path(room: str) -> tuple[int, ...]:
        return (*path(room.rpartition(".")[0]), floor[room]) if room in floor else ()

    return {room: path(room) for room in floor}


def room_of(module: str) -> str:
    """Return the innermost room that a module lies in."""
    rooms = [room for room in floors() if f"{module}.".startswith(f"{room}.")]
    assert rooms, f"{module} lies in no room of the contracts in pyproject.toml"
    return max(rooms, key=len)


@cache
def arrows() -> set[tuple[str, str]]:
    """Return from which room to which other there are imports; the package itself is none."""
    return {
        (room_of(module), room_of(imported))
        for module in imports().keys() - {PACKAGE}
        for imported in imports()[module] - {PACKAGE}
        if room_of(module) != room_of(imported)
    }


def test_every_module_but_the_way_in_lies_in_a_room() -> None:
    loose = {path.name for path in (PROJECT / PACKAGE).glob("*.py")}
    assert loose == {"__init__.py", "__main__.py", "api.py"}


def test_the_project_imports_its_own_modules_by_their_full_names() -> None:
    for module, tree in modules().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, module
            if isinstance(node, ast.Import):
                assert not any(is_own(alias.name) for alias in node.names), module


def test_no_modules_import_each_other_in_a_circle() -> None:
    try:
        TopologicalSorter(imports()).prepare()
    except CycleError as error:
        pytest.fail(" <- ".join(error.args[1]))


def test_rooms_import_downwards() -> None:
    assert {(a, b) for a, b in arrows() if floors()[a] >= floors()[b]} == set()


def test_what_is_computed_in_one_place_is_computed_nowhere_else() -> None:
    callers = {
        call: {
            module.removeprefix(f"{PACKAGE}.")
            for module, tree in modules().items()
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and ast.unparse(node.func) == call
        }
        for call in OWNERS
    }
    assert callers == {call: {owner} for call, owner in OWNERS.items()}


def test_every_class_has_a_name_of_its_own() -> None:
    where = defaultdict(list)
    for module, tree in modules().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                where[node.name].append(module)
    assert {name: places for name, places in where.items() if len(places) > 1} == {}
