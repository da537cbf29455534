"""The keys a recipe can have, and their docstrings, from the models."""

import ast
import inspect
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, get_args

from fire_atlas.recipe.base import BRANCHES, KINDS, Settings
from fire_atlas.recipe.inherit import EXTENDS
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.problem import KeyPath


def blocks_at(path: KeyPath) -> list[type[Settings]]:
    """Return the models the key ``path`` may hold; none where it holds plain values.

    The path may hold the kind of a block as a tag, as pydantic's errors do.
    """
    blocks: list[type[Settings]] = [Recipe]
    for key in path:
        if key in KINDS:
            blocks = [block for block in blocks if _kind_of(block) == key]
        elif key not in BRANCHES and not isinstance(key, int):  # an item is what its list holds
            fields = [block.model_fields.get(key) for block in blocks]
            blocks = [inner for field in fields if field for inner in _blocks_in(field.annotation)]
    return blocks


def keys_at(path: KeyPath) -> list[str]:
    """Return the keys known in the block ``path``, in model order."""
    keys = list(dict.fromkeys(key for block in blocks_at(path) for key in block.model_fields))
    return keys if path else [*keys, EXTENDS]


def all_keys(path: KeyPath = ()) -> Iterator[tuple[str, ...]]:
    """Yield the key path of everything a recipe may hold."""
    for key in keys_at(path):
        inner = (*map(str, path), key)
        yield inner
        if blocks_at(inner):
            yield from all_keys(inner)


def _kind_of(block: type[Settings]) -> str:
    """Return the tag of the one kind a source's model is for."""
    return f"<{get_args(block.model_fields['kind'].annotation)[0]}>"


def _blocks_in(annotation: Any) -> list[type[Settings]]:
    if isinstance(annotation, type) and issubclass(annotation, Settings):
        return [annotation]
    return [block for part in get_args(annotation) for block in _blocks_in(part)]


def key_docs(block: type[Settings]) -> dict[str, str]:
    """Return the docstring of each key of ``block`` that has one.

    For the schema and for advice alone: pydantic's own way, ``use_attribute_docstrings``, reads
    the source of every model at every start, which takes a quarter of what their import does.
    """
    docs: dict[str, str] = {}
    for owner in reversed(block.__mro__):
        if issubclass(owner, Settings):
            docs |= _own_docs(owner)
    return docs


def _own_docs(block: type[Settings]) -> dict[str, str]:
    try:
        source = inspect.getsource(block)
    except OSError:  # installed without its source
        return {}
    [definition] = ast.parse(source).body
    assert isinstance(definition, ast.ClassDef)
    docs = {}
    for key, below in pairwise(definition.body):
        match key, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(
                value=ast.Constant(value=str(text))
            ):
                docs[name] = inspect.cleandoc(text)
    return docs
