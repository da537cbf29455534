"""The words of the source: the field's, the papers', or plain English.

Read from the files alone. A word that stood for something of ours, which a stranger could not have
guessed, is retired: no name is made of it, and the field's own word is said in its place.
"""

import ast
import io
import re
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

PROJECT = Path(__file__).parents[1]
MODULES = sorted((PROJECT / "fire_atlas").rglob("*.py"))
DOCUMENTS = sorted([*PROJECT.glob("*.md"), *(PROJECT / "docs").rglob("*.md")])

INSTEAD = {
    "asked": "settings",
    "blaze": "generated fire",
    "breadth": "correlation length",
    "brood": "emitter settings",
    "bulk": "size score",
    "burn": "generate, synthesise",
    "burning": "generation settings",
    "climb": "rise time",
    "convention": "motion encoding",
    "crackle": "burst rate",
    "dress": "texture of a sheet",
    "evidence": "cross-validation",
    "face": "detail model",
    "film": "renderer",
    "grate": "fuel inlet",
    "haste": "time rate",
    "hatch": "spawn",
    "kinship": "autocorrelation",
    "lay_out": "build a sheet",
    "met": "intermediate flows",
    "plenty": "automatic rate",
    "proof": "validation report",
    "reel": "frame sequence",
    "rider": "attached to",
    "sink": "terminal velocity",
    "swarm": "particle state",
    "takes": "edit list",
    "temper": "calibration",
    "territory": "blend mask",
    "told": "written, stated, recorded",
    "trust": "reliability",
    "turned": "rotated",
    "weather": "wind response",
    "worn": "texture index",
}
"""Words that no name may be made of, and what is said instead."""

INSTEAD_OF_WHOLE = {
    "balance": "calibration",
    "footage": "cut analysis",
    "join": "transition",
    "layout": "sheet",
    "part": "contribution",
    "pose": "pose curves",
    "probable": "motion synthesis",
    "put": "placement",
    "quiet": "build view",
    "strip": "animation frames",
    "take": "settings",
    "throw": "impulse",
    "tint": "colour map",
}
"""Words that are good ones in company, but say nothing as the name of a class or a module."""

NOT_IN_PROSE = r"\b(told|by itself|broods?|swarms?|blazes?|reels?|kinships?|haste|grates?)\b"


TEXTS = {
    tokenize.COMMENT,
    tokenize.STRING,
    getattr(tokenize, "FSTRING_MIDDLE", tokenize.STRING),  # since Python 3.12
}


class Named(NamedTuple):
    """A name, where it is given, and whether it is that of a class or a module."""

    name: str
    path: str
    line: int
    is_thing: bool


def names() -> Iterator[Named]:
    """Yield what modules, classes, functions, attributes, parameters and variables are called."""
    for path in MODULES:
        place = path.relative_to(PROJECT).as_posix()
        yield Named(path.parent.name if path.stem == "__init__" else path.stem, place, 1, True)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if name := named_by(node):
                is_class = isinstance(node, ast.ClassDef)
                yield Named(name, place, getattr(node, "lineno", 1), is_class)


def named_by(node: ast.AST) -> str | None:
    """Return the name that a node of a syntax tree gives, None if it gives none."""
    match node:
        case ast.ClassDef(name=name) | ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
            return name
        case ast.arg(arg=name) | ast.Attribute(attr=name, ctx=ast.Store()):
            return name
        case ast.Name(id=name, ctx=ast.Store()) | ast.alias(asname=str(name)):
            return name
    return None


def better(name: str, is_thing: bool = False) -> str | None:
    """Return what to say instead of a retired word in ``name``, None where there is none."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).strip("_").lower()
    whole = INSTEAD_OF_WHOLE.get(spaced.removesuffix("s")) if is_thing else None
    found = (word for word in INSTEAD if re.search(rf"(?<![a-z]){word}s?(?![a-z])", spaced))
    return whole or next(map(INSTEAD.__getitem__, found), None)


def prose() -> Iterator[tuple[str, str]]:
    """Yield the texts of the source, its comments and its documents, each with its place."""
    for path in MODULES:
        text = path.read_text(encoding="utf-8")
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type in TEXTS:
                yield f"{path.relative_to(PROJECT)}:{token.start[0]}", token.string
    for path in DOCUMENTS:
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            yield f"{path.relative_to(PROJECT)}:{number}", line


@pytest.mark.parametrize("name", ["blaze", "SwarmState", "_by_face", "REELS", "lay_out_pages"])
def test_names_made_of_retired_words_are_found(name: str) -> None:
    assert better(name)


@pytest.mark.parametrize("name", ["Part", "joins", "Takes"])
def test_things_called_by_a_word_that_says_nothing_alone_are_found(name: str) -> None:
    assert better(name, is_thing=True)


@pytest.mark.parametrize(
    "name", ["surface", "PoseCurves", "part_of", "metres", "untrusted", "layout"]
)
def test_names_that_only_look_like_it_are_not(name: str) -> None:
    assert not better(name)


def test_no_name_is_made_of_a_retired_word() -> None:
    found = [
        f"{each.path}:{each.line} {each.name}: say {instead}"
        for each in names()
        if (instead := better(each.name, each.is_thing))
    ]
    assert found == []


def test_no_text_uses_a_word_that_only_we_understood() -> None:
    found = [
        f"{place}: {match[0]}"
        for place, text in prose()
        for match in re.finditer(NOT_IN_PROSE, re.sub("``?[^`]*``?", "", text), re.IGNORECASE)
    ]
    assert found == []


def test_every_class_has_a_name_of_its_own() -> None:
    where = defaultdict(list)
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                where[node.name].append(str(path.relative_to(PROJECT)))
    assert {name: places for name, places in where.items() if len(places) > 1} == {}
