"""Names of files, known before a build starts: what describes pages and flakes, and of any output
what may differ in its name."""

import re
from dataclasses import dataclass, replace
from typing import Literal, Self, TypeAlias

from fire_atlas.core.output_file import Role

OfEach: TypeAlias = Literal["", "page", "animation"]
"""Of what a recipe writes a file each; "" where there is only one."""

_PAGE = re.compile(r"-[1-9][0-9]{0,3}")
"""What stands in the names of all pages but the first."""


@dataclass(frozen=True, slots=True)
class OutputNames:
    """The name of an output, or the names of a row of them: one for each page or animation.

    Attributes:
        stem: Begins all of them.
        ending: Ends all of them. The first page, and an animation called like the build, have
            nothing between the two.
        role: Purpose of the files.
        of_each: Of what there is one each.
        is_certain: Whether every build of the recipe writes the file with nothing between.
    """

    stem: str
    ending: str
    role: Role
    of_each: OfEach = ""
    is_certain: bool = False

    @property
    def first(self) -> str:
        """The name with nothing between stem and ending."""
        return self.stem + self.ending

    def has(self, file: str) -> bool:
        """Return whether ``file``, a plain file name, is one of these names."""
        if file == self.first:
            return True
        between = file.removeprefix(self.stem).removesuffix(self.ending)
        if not between or self.stem + between + self.ending != file:
            return False
        if self.of_each == "page":
            return _PAGE.fullmatch(between) is not None
        return self.of_each == "animation" and len(between) > 1 and between.startswith(".")

    def beside(self, ending: str) -> Self:
        """Return the names of the import settings of these files, which end with ``ending``."""
        return replace(self, ending=self.ending + ending, role="import")


def animation_stem(build: str, animation: str) -> str:
    """Return the stem for files of one animation: the build's name if both have the same name."""
    if animation == build:
        return build
    return f"{build}.{animation.removeprefix(f'{build}/').replace('/', '.')}"


def flakes_file(stem: str, ending: str) -> str:
    """Return the file name of flake tracks in the format with this ending."""
    return f"{stem}.flakes.{ending}"


def light_file(stem: str) -> str:
    """Return the name of the file with the light of an animation, whose file stem is ``stem``."""
    return f"{stem}.light.json"
