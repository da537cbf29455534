"""Resolve ``extends``: merge a recipe with the recipe that it is based on."""

from pathlib import Path

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.files import real
from fire_atlas.core.shipped import shipped
from fire_atlas.recipe.document import RECIPE_ENDINGS, Document, read_document
from fire_atlas.recipe.problem import KeyPath, Value, did_you_mean

EXTENDS = "extends"
"""The key, which is removed here and so is in no model."""

_MAX_BASES = 50
"""Limit on the recipes that one extends, and that these extend."""


def merge(base: Document, over: Document) -> Document:
    """Return ``base`` overridden by ``over``: key by key in blocks; other values are replaced."""
    replaced: set[KeyPath] = set()
    values = _merge_values(base.values, over.values, (), replaced)
    kept = {
        path: origin
        for path, origin in base.origins.items()
        if not any(path[:depth] in replaced for depth in range(1, len(path) + 1))
    }
    return Document(values, {**kept, **over.origins})


def inherit(document: Document, path: Path) -> tuple[Document, tuple[Path, ...]]:
    """Return ``document`` (of the recipe ``path``) merged with the recipes that it extends.

    The second result lists every recipe file involved, ``path`` first.

    Raises:
        RecipeError: A base does not exist, is no recipe or leads back to a recipe that extends it;
            or there are more than ``_MAX_BASES``.
    """
    layers, files = [document], [path]
    while EXTENDS in layers[-1].values:
        base = _base_of(layers[-1], files[-1])
        _refuse_circle(layers[-1], files, base)
        if len(files) > _MAX_BASES:
            where = layers[-1].origins[(EXTENDS,)].locate((EXTENDS,))
            raise RecipeError(
                f"{where}: is number {len(files)} in a row of recipes that extend each other, and "
                f"at most {_MAX_BASES} are followed; write some of them into one file"
            )
        layers.append(read_document(base))
        files.append(base)
    merged = layers.pop()
    while layers:
        merged = merge(merged, layers.pop())
    values = {key: value for key, value in merged.values.items() if key != EXTENDS}
    return Document(values, merged.origins), tuple(files)


def presets() -> dict[str, Path]:
    """Return the recipes that are shipped with the tool, by name."""
    return {path.stem: path for path in sorted(shipped("recipes").glob("*.yaml"))}


def instead_of(name: str) -> str:
    """Return what to write for ``name``, which is no preset: ``"; did you mean torch?"``."""
    if name == "paper":  # a value of `features.preset`, which is easily taken for one of these
        return (
            "; write `features: {preset: paper}` and `atlas: {alpha: premultiplied}` in your "
            "recipe instead, or copy the whole one from docs/papers.md"
        )
    return did_you_mean(name, presets()) or f"; presets are {', '.join(presets())}"


def _merge_values(
    base: dict[str, Value], over: dict[str, Value], at: KeyPath, replaced: set[KeyPath]
) -> dict[str, Value]:
    merged = dict(base)
    for key, value in over.items():
        below = base.get(key)
        if isinstance(below, dict) and isinstance(value, dict):
            merged[key] = _merge_values(below, value, (*at, key), replaced)
        else:
            merged[key] = value
            replaced.add((*at, key))
    return merged


def _base_of(document: Document, path: Path) -> Path:
    """Return the file that ``extends`` names: a preset, or a path relative to ``path``."""
    name = document.values[EXTENDS]
    where = document.origins[(EXTENDS,)].locate((EXTENDS,))
    if not isinstance(name, str) or not name or "\0" in name:
        raise RecipeError(f"{where}: must be the name of a preset or the path of a recipe")
    if "/" in name or "\\" in name or name.endswith(RECIPE_ENDINGS):
        file = path.parent / name
        if not file.is_file():
            raise RecipeError(f"{where}: there is no recipe file {file}")
        return file
    if name in presets():
        return presets()[name]
    raise RecipeError(f"{where}: there is no preset {name}{_suggestion(name, path)}")


def _suggestion(name: str, path: Path) -> str:
    for beside in (path.with_name(name + ending) for ending in RECIPE_ENDINGS):
        if beside.is_file() and beside.name != path.name:
            return f"; did you mean the file ./{beside.name}?"
    return instead_of(name)


def _refuse_circle(document: Document, files: list[Path], base: Path) -> None:
    seen = [real(file) for file in files]
    if real(base) in seen:
        circle = [*files[seen.index(real(base)) :], base]
        way = " -> ".join(file.name for file in circle)
        where = document.origins[(EXTENDS,)].locate((EXTENDS,))
        raise RecipeError(f"{where}: goes round in a circle ({way}); remove one `extends`")
