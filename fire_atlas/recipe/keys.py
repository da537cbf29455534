"""Look up the keys that a recipe can have, and their docstrings, in the models."""

import ast
import inspect
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, get_args

from pydantic.fields import FieldInfo

from fire_atlas.recipe.base import BRANCHES, KINDS, Settings
from fire_atlas.recipe.inherit import EXTENDS
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.problem import KeyPath


def blocks_at(path: KeyPath) -> list[type[Settings]]:
    """Return the models of the blocks allowed at the key ``path``; none for a plain value.

    The path may contain the tag of a source's kind, as in pydantic's errors.
    """
    blocks: list[type[Settings]] = [Recipe]
    for key in path:
        if key in KINDS:
            blocks = [block for block in blocks if _kind_of(block) == key]
        elif key not in BRANCHES and not isinstance(key, int):  # a list has the blocks of its items
            fields = [_fields(block).get(str(key)) for block in blocks]
            blocks = [inner for field in fields if field for inner in _blocks_in(field.annotation)]
    return blocks


def keys_at(path: KeyPath) -> list[str]:
    """Return the keys of the block ``path``, in the order of the model."""
    keys = list(dict.fromkeys(key for block in blocks_at(path) for key in _fields(block)))
    return keys if path else [*keys, EXTENDS]


def _fields(block: type[Settings]) -> dict[str, FieldInfo]:
    """Return the fields of a block by their keys in a recipe."""
    return {field.alias or name: field for name, field in block.model_fields.items()}


def all_keys(path: KeyPath = ()) -> Iterator[tuple[str, ...]]:
    """Yield the key path of every key that a recipe can have."""
    for key in keys_at(path):
        inner = (*map(str, path), key)
        yield inner
        if blocks_at(inner):
            yield from all_keys(inner)


def _kind_of(block: type[Settings]) -> str:
    """Return the tag of the kind of source that a model is for."""
    return f"<{get_args(block.model_fields['kind'].annotation)[0]}>"


def _blocks_in(annotation: Any) -> list[type[Settings]]:
    if isinstance(annotation, type) and issubclass(annotation, Settings):
        return [annotation]
    return [block for part in get_args(annotation) for block in _blocks_in(part)]


def key_docs(block: type[Settings]) -> dict[str, str]:
    """Return the docstring of each key of ``block`` that has one.

    Only the schema and error messages need them. pydantic's ``use_attribute_docstrings`` would read
    them at every start, which takes a quarter of the time of importing the models.
    """
    docs: dict[str, str] = {}
    for owner in reversed(block.__mro__):
        if issubclass(owner, Settings):
            docs |= _own_docs(owner)
    fields = block.model_fields
    return {fields[name].alias or name: text for name, text in docs.items()}


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
