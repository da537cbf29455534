"""Options of the export ``unity``."""

from typing import Annotated, Self

from pydantic import AfterValidator, Field, model_validator

from fire_atlas.recipe.base import Settings
from fire_atlas.recipe.problem import ContradictionError, Problem

DEFAULT_NAMESPACE = "FireAtlas"

_KEYWORDS = """
abstract as base bool break byte case catch char checked class const continue decimal default
delegate do double else enum event explicit extern false finally fixed float for foreach goto if
implicit in int interface internal is lock long namespace new null object operator out override
params private protected public readonly ref return sbyte sealed short sizeof stackalloc static
string struct switch this throw true try typeof uint ulong unchecked unsafe ushort using virtual
void volatile while
"""
"""Words that are no names in C#."""

_FOREIGN = ("System", "UnityEngine", "UnityEditor")
"""Namespaces of others: one of that name would hide them from scripts inside it."""


def _free(namespace: str) -> str:
    """Validate a namespace, whose form is sound."""
    for word in namespace.split("."):
        if word in _KEYWORDS.split():
            raise ValueError(f"{word} is a word of C#; choose another name")
        if word in _FOREIGN:
            raise ValueError(f"{word} belongs to others; choose a name of your own")
    return namespace


NAMESPACE_PATTERN = r"^[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*$"


class UnityOptions(Settings):
    """What Unity is to be given."""

    pixels_per_unit: float = Field(default=100.0, ge=0.01, le=100000)
    """Pixels of the full-size frame that are one unit long in the scene."""
    flakes: bool = True
    """Write the flakes' tracks, and a component that plays them."""
    namespace: Annotated[
        str,
        Field(max_length=100, pattern=NAMESPACE_PATTERN),
        AfterValidator(_free),
    ] = DEFAULT_NAMESPACE
    """C# namespace of the component; GUIDs and the names of shaders are made from it too. Two
    recipes of one name in one Unity project need two."""
    assembly: bool = False
    """Write an assembly definition for the output folder, called as the namespace. Unity allows
    one a folder, and scripts in folders below belong to it too."""

    @model_validator(mode="after")
    def _name_the_assembly(self) -> Self:
        if self.assembly and self.namespace == DEFAULT_NAMESPACE:
            problem = Problem(
                ("assembly",),
                "needs a `namespace` of your own, another for each folder: Unity allows an "
                "assembly's name once in a project",
            )
            raise ContradictionError(problem)
        return self
