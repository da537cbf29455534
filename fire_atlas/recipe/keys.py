"""Which keys a recipe has, read off the models."""

from collections.abc import Iterator
from typing import Any, get_args

from fire_atlas.recipe.base import BRANCHES, KINDS, Settings
from fire_atlas.recipe.inherit import EXTENDS
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.origin import KeyPath


def blocks_at(path: KeyPath) -> list[type[Settings]]:
    """Return the models the key ``path`` may hold; none where it holds plain values.

    The path may tell the kind of a block by its tag, as pydantic's errors do.
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
