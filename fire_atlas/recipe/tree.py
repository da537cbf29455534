"""Read a recipe with all that it extends and its members, without validation or pydantic."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.files import real
from fire_atlas.core.output_file import MANIFEST_ENDING, as_file_name, is_device, is_reserved
from fire_atlas.recipe.document import RECIPE_ENDINGS, parse_override, read_document
from fire_atlas.recipe.inherit import inherit, merge, presets
from fire_atlas.recipe.problem import KeyPath, Origin, Value, did_you_mean

NAME_PATTERN = r"^[A-Za-z0-9_]([A-Za-z0-9_.\-]*[A-Za-z0-9_\-])?$"
"""A file stem that works on every system and in every engine."""

NAME_ADVICE = (
    "must be a plain file name, not a path: letters, digits, `_`, `-` and `.`,"
    " beginning with a letter, a digit or `_`; not one that Windows keeps for a device, like con,"
    " nor one that ends in .manifest"
)

MAX_NAME = 100
"""Maximum length of a name, characters."""


@dataclass(frozen=True, slots=True)
class RecipeTree:
    """The keys of a recipe, merged with those it inherits and those set by ``--set``.

    Attributes:
        path: The recipe file, as the user named it.
        values: Plain values by key; ``extends`` is removed.
        origins: Key path → where the value was written.
        files: Every recipe file that was read, ``path`` first.
        members: The recipes of ``atlas.members``, whose effects share the pages.
    """

    path: Path
    values: dict[str, Value]
    origins: dict[KeyPath, Origin]
    files: tuple[Path, ...]
    members: tuple["RecipeTree", ...] = ()

    @property
    def name(self) -> str:
        """The file stem of all outputs: ``name``, or the stem of the recipe file."""
        given = self.values.get("name", self.path.stem)
        if isinstance(given, str) and is_name(given):
            return given
        if "name" in self.values:
            raise RecipeError(f"{self.origin(('name',)).locate(('name',))}: {NAME_ADVICE}")
        raise RecipeError(
            f"{self.path}: outputs cannot be called {given!r} like the recipe file; "
            f"add a line `name: {nearest_name(self.path.stem)}`"
        )

    @property
    def has_source(self) -> bool:
        """Whether the recipe has a ``source`` that is not null, and so frames of its own."""
        return self.values.get("source") is not None

    def value(self, path: KeyPath) -> Value:
        """Return the value of the key ``path``; None if there is none."""
        value: Value = self.values
        for key in path:
            match value, key:
                case dict(), str():
                    value = value.get(key)
                case list(), int():
                    value = value[key]
                case _:
                    return None
        return value

    def origin(self, path: KeyPath) -> Origin:
        """Return where the key ``path`` was written, or if it was not, the block around it."""
        while path and path not in self.origins:
            path = path[:-1]
        return self.origins[path]

    def file_at(self, path: KeyPath, text: str) -> Path:
        """Return the absolute path of the file ``text`` that the key ``path`` names.

        ``text`` is relative to the recipe file with that key. If ``--set`` gave it, it is relative
        to the recipe: a build must not depend on the folder in which it is started.
        """
        return real(self.named_at(path, text))

    def named_at(self, path: KeyPath, text: str) -> Path:
        """Return the path ``text`` that the key ``path`` names, as ``file_at``, with its links."""
        return (self.origin(path).file or self.path).parent / text


def as_draft(tree: RecipeTree) -> RecipeTree:
    """Return ``tree`` with ``atlas.gpu_quality: draft``, unless the recipe states a quality or has
    no ``atlas.gpu``."""
    atlas = tree.values.get("atlas")
    if not isinstance(atlas, dict) or not atlas.get("gpu") or "gpu_quality" in atlas:
        return tree
    return replace(tree, values={**tree.values, "atlas": {**atlas, "gpu_quality": "draft"}})


MEMBERS = ("atlas", "members")
"""The key that lists the recipes whose effects share the pages."""


def is_recipe(path: Path) -> bool:
    """Return whether a path is that of a recipe, by its ending."""
    return path.suffix in RECIPE_ENDINGS


def read_tree(path: Path, overrides: Sequence[str] = ()) -> RecipeTree:
    """Read the recipe ``path`` with all that it extends, ``overrides`` (``key=value``) and members.

    Raises:
        RecipeError: A file cannot be read, a member has members itself, or two have one name.
    """
    tree = read_without_members(path, overrides)
    return replace(tree, members=_read_members(tree))


def read_without_members(path: Path, overrides: Sequence[str] = ()) -> RecipeTree:
    """Read a recipe like ``read_tree``, but not its members.

    That is enough to know its name, and with it the files that its builds wrote.
    """
    if not path.exists():
        near = did_you_mean(path.stem, presets(), "fire-atlas init ")
        raise RecipeError(f"{path}: there is no such recipe file{near}")
    document = read_document(path)
    for text in overrides:
        document = merge(document, parse_override(text))
    document, files = inherit(document, path)
    return RecipeTree(path, document.values, document.origins, files)


def _read_members(tree: RecipeTree) -> tuple[RecipeTree, ...]:
    members = tree.value(MEMBERS)
    if not members or not isinstance(members, list):
        return ()
    found: list[RecipeTree] = []
    taken = {as_file_name(tree.name): tree.name} if tree.has_source else {}
    for i, name in enumerate(members):
        where = tree.origin((*MEMBERS, i)).locate((*MEMBERS, i))
        if not isinstance(name, str) or not name or "\0" in name:
            raise RecipeError(f"{where}: must be the path of a recipe")
        member = read_without_members(tree.file_at((*MEMBERS, i), name))
        if member.value(MEMBERS):
            raise RecipeError(f"{where}: has members itself; name those here instead")
        key = as_file_name(member.name)
        if key in taken:
            raise RecipeError(
                f"{where}: another effect on these pages is called {taken[key]} too; give one of "
                f"them another `name`"
            )
        taken[key] = member.name
        found.append(member)
    return tuple(found)


TEMPLATE_SUFFIXES = (".j2", ".jinja", ".jinja2")
"""Endings that a template must have if it is outside of the recipe's folder."""

SOURCE_PATHS = (("source", "path"), ("source", "side_path"), ("source", "texture", "path"))
"""The keys, of any kind of source, that name files."""


def source_files(tree: RecipeTree) -> dict[KeyPath, Path]:
    """Return the absolute path (or glob) of each file that the source names, by its key: of each
    item, if that is a list."""
    named = {key: text for path in SOURCE_PATHS for key, text in _items(path, tree.value(path))}
    named |= {key: text for key, text in _masks(tree) if text != "none"}
    return {key: tree.file_at(key, text) for key, text in named.items() if isinstance(text, str)}


def _masks(tree: RecipeTree) -> Iterator[tuple[KeyPath, Value]]:
    """Yield what each arrangement of sheets burns ``on``, by its key."""
    for key, sheets in _items(("source", "sheets"), tree.value(("source", "sheets"))):
        if isinstance(sheets, dict) and "on" in sheets:
            yield (*key, "on"), sheets["on"]


def _items(path: KeyPath, value: Value) -> Iterator[tuple[KeyPath, Value]]:
    """Yield a value with its key, or each item of a list with its own."""
    if isinstance(value, list):
        yield from (((*path, i), item) for i, item in enumerate(value))
    else:
        yield path, value


TEXTURE_PATHS = (("flakes", "texture"), ("flakes", "texture", "path"))
"""The keys that can name the texture of flakes; a recipe has one of them."""


def texture_files(tree: RecipeTree) -> dict[KeyPath, Path]:
    """Return the absolute path of the texture of flakes, if there is one, by its key."""
    values = {key: tree.value(key) for key in TEXTURE_PATHS}
    return {
        key: tree.file_at(key, text)
        for key, text in values.items()
        if isinstance(text, str) and text != "none"
    }


def named_files(tree: RecipeTree) -> dict[KeyPath, Path]:
    """Return the absolute path (or glob) of each file that the keys of a recipe name as input."""
    return {**source_files(tree), **texture_files(tree)}


def templates(tree: RecipeTree) -> dict[str, Path]:
    """Return the absolute path of each template in ``exports``, by its path in the recipe.

    Raises:
        RecipeError: A template is outside of the recipe's folder and has no ending of
            ``TEMPLATE_SUFFIXES``. Otherwise an untrusted recipe could copy any of the user's files
            into its outputs, by a path or a link.
    """
    exports = tree.values.get("exports")
    found = {}
    for i, export in enumerate(exports if isinstance(exports, list) else []):
        name = export.get("template") if isinstance(export, dict) else None
        if isinstance(name, str):
            found[name] = _template_at(tree, ("exports", i, "template"), name)
    return found


def _template_at(tree: RecipeTree, key: KeyPath, name: str) -> Path:
    path, origin = tree.file_at(key, name), tree.origin(key)
    folder = real((origin.file or tree.path).parent)
    if not path.is_relative_to(folder) and path.suffix not in TEMPLATE_SUFFIXES:
        raise RecipeError(
            f"{path} lies outside the recipe's folder; templates from there must have a name that "
            f"ends in {', '.join(TEMPLATE_SUFFIXES)}"
        ).placed(origin.locate(key))
    return path


def is_name(text: str) -> bool:
    """Return whether outputs may be called ``text``."""
    is_plain = len(text) <= MAX_NAME and re.fullmatch(NAME_PATTERN, text) is not None
    return is_plain and not is_device(text) and not is_reserved(f"{text}.json")


def nearest_name(text: str) -> str:
    """Return a valid name that is similar to ``text``."""
    manifest = MANIFEST_ENDING.removesuffix(".json")
    plain = re.sub(r"[^A-Za-z0-9_.\-]+", "_", text)[:MAX_NAME].strip("-._")
    if is_reserved(f"{plain}.json"):
        plain = plain[: -len(manifest)]
    return next(name for name in (plain, f"{plain}_", "effect") if is_name(name))
