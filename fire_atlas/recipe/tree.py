"""A recipe as it was written: merged, not yet validated. Imports no pydantic."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.output_file import is_device
from fire_atlas.recipe.document import parse_override, read_document
from fire_atlas.recipe.inherit import inherit, merge
from fire_atlas.recipe.problem import KeyPath, Origin, Value

NAME_PATTERN = r"^[A-Za-z0-9_]([A-Za-z0-9_.\-]*[A-Za-z0-9_\-])?$"
"""A file stem that is good on every system and in every engine."""

NAME_ADVICE = (
    "must be a plain file name, not a path: letters, digits, `_`, `-` and `.`,"
    " beginning with a letter, a digit or `_`; not one that Windows keeps for a device, like con"
)

MAX_NAME = 100
"""Longest name, characters."""


@dataclass(frozen=True, slots=True)
class RecipeTree:
    """A recipe's own keys, what it extends and what ``--set`` changes, as one tree.

    Attributes:
        path: The recipe file, as the user named it.
        values: Plain values by key; ``extends`` is removed.
        origins: Key path → where the value was written.
        files: Every recipe file that was read, ``path`` first.
        members: The recipes whose effects share its pages (``atlas.members``); they have none.
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
        """Whether the recipe brings frames of its own: a ``source`` that is null brings none."""
        return self.values.get("source") is not None

    def value(self, path: tuple[str, ...]) -> Value:
        """Return what stands at ``path``; None where nothing does."""
        value: Value = self.values
        for key in path:
            value = value.get(key) if isinstance(value, dict) else None
        return value

    def origin(self, path: KeyPath) -> Origin:
        """Return where ``path`` was written, or else the nearest block around it."""
        while path and path not in self.origins:
            path = path[:-1]
        return self.origins[path]

    def file_at(self, path: KeyPath, text: str) -> Path:
        """Return the absolute path that the key ``path`` means by ``text``.

        It is relative to the recipe file that states it; what ``--set`` states is relative to the
        recipe it changes, so that a build does not depend on the folder it is started in.
        """
        folder = (self.origin(path).file or self.path).parent
        return (folder / text).resolve()


MEMBERS = ("atlas", "members")
"""The key that names recipes whose effects share the pages of another."""


def read_tree(path: Path, overrides: Sequence[str] = ()) -> RecipeTree:
    """Return the recipe ``path`` with ``overrides`` (``key=value``), all it extends, and members.

    This is where members are read, once: whoever needs one finds it in ``members``.

    Raises:
        RecipeError: A file cannot be read, or a member has members itself or another's name.
    """
    tree = read_without_members(path, overrides)
    return replace(tree, members=_read_members(tree))


def read_without_members(path: Path, overrides: Sequence[str] = ()) -> RecipeTree:
    """Return the recipe ``path`` as far as its own keys go, whatever its members may be.

    That is enough to know its name, and so which files its builds wrote.
    """
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
    taken = {tree.name} if tree.has_source else set[str]()
    for i, name in enumerate(members):
        where = tree.origin((*MEMBERS, i)).locate((*MEMBERS, i))
        if not isinstance(name, str) or not name or "\0" in name:
            raise RecipeError(f"{where}: must be the path of a recipe")
        member = read_without_members(tree.file_at((*MEMBERS, i), name))
        if member.value(MEMBERS):
            raise RecipeError(f"{where}: has members itself; name those here instead")
        if member.name in taken:
            raise RecipeError(
                f"{where}: another effect on these pages is called {member.name} too; give one of "
                f"them another `name`"
            )
        taken.add(member.name)
        found.append(member)
    return tuple(found)


TEMPLATE_SUFFIXES = (".j2", ".jinja", ".jinja2")
"""How the names of templates end that recipes of several folders share."""

SOURCE_PATHS = (("source", "path"), ("source", "side_path"), ("source", "texture", "path"))
"""The keys of a source, of any kind, that name files."""


def source_files(tree: RecipeTree) -> dict[tuple[str, ...], Path]:
    """Return the absolute path (or glob) of each file that the source names, by its key."""
    stated = {key: tree.value(key) for key in SOURCE_PATHS}
    return {key: tree.file_at(key, text) for key, text in stated.items() if isinstance(text, str)}


def templates(tree: RecipeTree) -> dict[str, Path]:
    """Return the absolute path of each template in ``exports``, by what the recipe calls it.

    Raises:
        RecipeError: It lies outside the folder of the recipe that names it, and is not called like
            a template. A recipe that came from a stranger must not carry any of the user's files
            into its outputs, be it by its path or by a link.
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
    folder = (origin.file or tree.path).parent.resolve()
    if not path.is_relative_to(folder) and path.suffix not in TEMPLATE_SUFFIXES:
        raise RecipeError(
            f"{origin.locate(key)}: {path} lies outside the recipe's folder, where only files "
            f"whose names end in {', '.join(TEMPLATE_SUFFIXES)} are taken for templates"
        )
    return path


def is_name(text: str) -> bool:
    """Return whether outputs may be called ``text``."""
    is_plain = len(text) <= MAX_NAME and re.fullmatch(NAME_PATTERN, text) is not None
    return is_plain and not is_device(text)


def nearest_name(text: str) -> str:
    """Return a good name that looks like ``text``."""
    plain = re.sub(r"[^A-Za-z0-9_.\-]+", "_", text)[:MAX_NAME].strip("-._")
    return next(name for name in (plain, f"{plain}_", "effect") if is_name(name))
