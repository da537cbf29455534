"""Compute the key of a build in a cache: the digest of everything that decides its bytes."""

import json
import os
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Self

from fire_atlas.core.cpu import cpu_class
from fire_atlas.outputs.dependencies import inputs_of
from fire_atlas.outputs.digest import HashedFile, request_digest, text_digest, tool_digest
from fire_atlas.outputs.manifest import InputEntry, Manifest, input_path
from fire_atlas.recipe.tree import RecipeTree

_SHORT = 8
"""Digits of a digest that are shown to people, who compare those of two machines."""


@dataclass(frozen=True, slots=True)
class CacheKey:
    """Everything that decides which bytes a build writes. Equal keys mean equal outputs.

    Attributes:
        recipe: Digest of the recipe's values, with inherited ones and those of its members.
        inputs: Digest of the names and contents of all files of sources and templates.
        tool: Digest of the code and the versions of the libraries.
        cpu: The class of the CPU.
        system: The operating system, and its C library, whose functions round in their own way.
    """

    recipe: str
    inputs: str
    tool: str
    cpu: str
    system: str

    @classmethod
    def of_tree(cls, tree: RecipeTree) -> Self:
        """Return the key of a build of ``tree`` now, on this machine.

        Raises:
            SourceError: An input is missing, or cannot be read.
        """
        folder = tree.path.parent
        files = [HashedFile.of(path) for path in inputs_of(tree)]
        inputs = [InputEntry(input_path(file.path, folder), file.sha256) for file in files]
        return cls(request_digest(tree), _digest(inputs), tool_digest(), cpu_class(), _system())

    @classmethod
    def of_manifest(cls, manifest: Manifest) -> Self:
        """Return the key of the build that wrote ``manifest``, if it was made on this system."""
        cpu = str(manifest.statistics.get("cpu"))
        inputs = _digest(manifest.inputs)
        return cls(manifest.request_digest, inputs, manifest.tool_digest, cpu, _system())

    @property
    def digest(self) -> str:
        """The SHA-256 of the key, as hexadecimal digits: the name of the build in a cache."""
        return text_digest(json.dumps(asdict(self)))

    def __str__(self) -> str:
        """Return what people compare if one machine does not find what another has stored."""
        recipe, inputs, tool = (digest[:_SHORT] for digest in (self.recipe, self.inputs, self.tool))
        made_from = f"recipe {recipe}, inputs {inputs}, tool {tool}, {self.cpu}, {self.system}"
        return f"{self.digest[:_SHORT]} ({made_from})"


def _digest(inputs: Iterable[InputEntry]) -> str:
    return text_digest(json.dumps([[entry.path, entry.sha256] for entry in inputs]))


def _system() -> str:
    """Return the name of the operating system, with the version of its C library if it tells."""
    try:
        library = os.confstr("CS_GNU_LIBC_VERSION") if hasattr(os, "confstr") else None
    except (OSError, ValueError):  # another C library
        library = None
    return f"{sys.platform} {library}" if library else sys.platform
