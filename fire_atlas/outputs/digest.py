"""Compute the SHA-256 digests in a manifest: of files, of the recipe, of this tool."""

import hashlib
import json
import os
import re
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from io import BufferedReader
from pathlib import Path
from typing import Self

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import open_file
from fire_atlas.core.shipped import shipped
from fire_atlas.recipe.tree import RecipeTree

_PROJECT = "fire-atlas"
_CHECKOUT = Path(__file__).resolve().parents[2] / "pyproject.toml"
"""Lists the requirements if the tool runs from a checkout without being installed."""

_WITHOUT_BYTES = ("extra == 'cache'", "extra == 'cluster'", "extra == 'test'")
"""Marks requirements that compute no byte of an output."""


@dataclass(frozen=True, slots=True)
class HashedFile:
    """An input file of a build, hashed before the build opens it.

    Attributes:
        path: Absolute.
        sha256: Of its bytes, as hexadecimal digits.
        stamp: Identity, size and times in the file system, read just before hashing.
    """

    path: Path
    sha256: str
    stamp: tuple[int, ...]

    @classmethod
    def of(cls, path: Path) -> Self:
        """Hash the file as it is now.

        Raises:
            SourceError: It cannot be read.
        """
        try:
            stamp = _stamp(path)
            return cls(path, file_digest(path), stamp)
        except OSError as error:
            raise SourceError(f"{path}: cannot be read ({error.strerror})") from error

    def is_unchanged(self) -> bool:
        """Return whether the file was neither written to nor replaced since it was hashed."""
        try:
            return _stamp(self.path) == self.stamp
        except OSError:
            return False


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file, as hexadecimal digits."""
    with open_file(path) as file:
        return sha256_of(file)


def sha256_of(file: BufferedReader) -> str:
    """Return the SHA-256 of what is left to read of an open file, as hexadecimal digits."""
    return hashlib.file_digest(file, "sha256").hexdigest()


def _stamp(path: Path) -> tuple[int, ...]:
    """Return numbers that change whenever the file is written to or replaced."""
    about = path.stat()
    return about.st_dev, about.st_ino, about.st_size, about.st_mtime_ns, about.st_ctime_ns


def text_digest(text: str) -> str:
    """Return the SHA-256 of a text in UTF-8."""
    return hashlib.sha256(text.encode()).hexdigest()


def request_digest(tree: RecipeTree) -> str:
    """Return the SHA-256 of a recipe's and its members' values, with inherited and ``--set`` ones.

    Comments, and the file and line of a key, make no difference.
    """
    return text_digest(
        json.dumps([[recipe.name, recipe.values] for recipe in (tree, *tree.members)])
    )


@cache
def tool_digest() -> str:
    """Return the SHA-256 of the code and library versions, on which outputs depend.

    Computed once: edits to the code do not affect a process that runs already.
    """
    digest = hashlib.sha256()
    package = Path(__file__).resolve().parents[1]
    for folder, ending in ((package, ".py"), (shipped("templates"), "")):
        for name, path in _files(folder, ending):
            digest.update(name.encode())
            with open(path, "rb") as file:  # noqa: PTH123
                digest.update(file.read())
    for library in libraries():
        digest.update(f"{library} {_version(library)}\n".encode())
    return digest.hexdigest()


def _files(folder: Path, ending: str) -> list[tuple[str, str]]:
    """Return the name in ``folder`` and the path of every file below it with this ``ending``.

    As text, because hundreds of ``Path`` objects take longer than all else about the digest.
    """
    start = len(str(folder)) + 1
    paths = [
        f"{inside}{os.sep}{name}"
        for inside, _, names in os.walk(folder)
        for name in names
        if name.endswith(ending)
    ]
    return sorted((path[start:].replace(os.sep, "/"), path) for path in paths)


def libraries() -> list[str]:
    """Return the names of the distributions that the tool and its extras need to write outputs.

    The version of any of them may change the bytes of an output.
    """
    needed = [
        requirement
        for requirement in _requirements()
        if not requirement.replace('"', "'").endswith(_WITHOUT_BYTES)
    ]
    return sorted(
        {re.split(r"[^\w.-]", requirement, maxsplit=1)[0].lower() for requirement in needed}
    )


def _requirements() -> list[str]:
    """Return the tool's requirements, from its installed metadata or from the checkout."""
    try:
        return metadata.requires(_PROJECT) or []
    except metadata.PackageNotFoundError:
        import tomllib

        project = tomllib.loads(_CHECKOUT.read_text(encoding="utf-8"))["project"]
        extras = project["optional-dependencies"].items()
        return [*project["dependencies"]] + [
            f"{requirement}; extra == '{extra}'"
            for extra, needed in extras
            for requirement in needed
        ]


def _version(library: str) -> str:
    try:
        about = metadata.distribution(library)
    except metadata.PackageNotFoundError:
        return "absent"  # some only come with an extra
    # `about.version` would parse all of the file, which has the library's whole README.
    line = re.search(r"^Version: (.*)$", about.read_text("METADATA") or "", re.MULTILINE)
    return line[1] if line else about.version
