"""Base class and types that all recipe models share: strict blocks, unions, colours."""

import os
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    Tag,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

# A plugin must not change what a recipe means, and to look for some in all installed packages takes
# as long as to build the models.
os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"


class Settings(BaseModel):
    """A block of a recipe. It is immutable and refuses unknown keys, NaN and infinity.

    Types are strict: ``"80"`` and ``yes`` are not accepted as numbers.
    """

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        allow_inf_nan=False,
        defer_build=True,  # validators are built once, with the whole recipe, not for each block
    )


def ordered(value: tuple[float, float]) -> tuple[float, float]:
    """Return a [min, max] pair, or refuse it if min exceeds max."""
    if value[0] > value[1]:
        raise ValueError(f"the first number must not exceed the second; got {list(value)}")
    return value


Entry = TypeVar("Entry")


def different(values: tuple[Entry, ...]) -> tuple[Entry, ...]:
    """Return ``values``, or refuse them if one of them is listed twice."""
    for i, value in enumerate(values):
        if value in values[:i]:
            shown = value if isinstance(value, str | float) else "the same entry"
            raise ValueError(f"{shown} is listed twice; once is enough")
    return values


DIFFERENT = AfterValidator(different)
"""Refuses a list in which a value is twice."""


_OFF = ("off", "no", None)


def none_of_off(value: Any) -> Any:
    """Accept ``off`` and ``no`` (which PyYAML reads as false) and ``~`` (null) as ``none``."""
    return "none" if value is False or value in _OFF else value


ALSO_NONE = {"enum": [*_OFF, False]}
"""Schema of what else means ``none``."""


class _Off(BeforeValidator):
    """Reads what else means ``none``, and says so in the schema: editors read YAML 1.2, in which
    ``off`` and ``no`` are words."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"anyOf": [handler(schema), ALSO_NONE]}


OFF = _Off(none_of_off)
"""Annotation of every choice that includes the word ``none``."""

LIST = Field(strict=False)
"""Annotation of every tuple: YAML has only lists, which strict mode would refuse."""

COLOR_PATTERN = r"^#[0-9a-fA-F]{6}$"

Color = Annotated[str, Field(pattern=COLOR_PATTERN)]
"""An sRGB colour like ``#ff7300``."""

Direction = Annotated[
    tuple[Annotated[float, Field(ge=-100, le=100)], Annotated[float, Field(ge=-100, le=100)]], LIST
]
"""[x, y], with x to the right and y up."""


# Tags for the branches of unions. If a key accepts several types, the type of the given value picks
# the branch, so that an error is only about the type that was meant. Users never see the tags.

NONE, BLOCK = Tag("<none>"), Tag("<block>")
AUTO, NUMBER, PAIR = Tag("<auto>"), Tag("<number>"), Tag("<pair>")
COLOURS = Tag("<colours>")
WORD, SWITCH, AS_SOURCE = Tag("<word>"), Tag("<switch>"), Tag("<source>")
CSS, TEMPLATE, UNITY = Tag("<css>"), Tag("<template>"), Tag("<unity>")
FRAMES, PROFILE, SILK = Tag("<frames>"), Tag("<profile>"), Tag("<silk>")
FLUID, SPRITES = Tag("<fluid>"), Tag("<sprites>")
SHEET, ARRANGEMENT = Tag("<sheet>"), Tag("<arrangement>")
KINDS = frozenset(tag.tag for tag in (FRAMES, PROFILE, SILK, FLUID, SPRITES))
"""Tags of the kinds of source."""
BRANCHES = KINDS | {
    tag.tag
    for tag in (
        *(NONE, BLOCK, AUTO, NUMBER, PAIR, COLOURS, WORD, SWITCH, AS_SOURCE, SHEET, ARRANGEMENT),
        *(CSS, TEMPLATE, UNITY),
    )
}
"""All tags, as they appear in the paths of pydantic's errors."""

UNDECIDED = "undecided"
"""pydantic error type: a value fits no branch of a union."""

UNKNOWN_KIND = "unknown_kind"
"""pydantic error type: the ``kind`` of a block does not exist. The message lists the kinds."""

Auto = Annotated[Literal["auto"], AUTO]
"""The word ``auto``, as one branch of a union."""

Off = Annotated[Literal["none"], NONE]
"""The word ``none``, as one branch of a union."""


def _branch(value: Any) -> str | None:
    match value:
        case "none":
            return NONE.tag
        case "auto":
            return AUTO.tag
        case "source":
            return AS_SOURCE.tag
        case str():
            return WORD.tag
        case bool():
            return SWITCH.tag
        case int() | float():
            return NUMBER.tag
        case list() | tuple():
            return PAIR.tag
        case dict() | Settings():
            return BLOCK.tag
    return None


def either(kinds: str) -> Discriminator:
    """Return pydantic's selector of a union's branch; error messages describe them by ``kinds``."""
    return Discriminator(
        _branch, custom_error_type=UNDECIDED, custom_error_message=f"must be {kinds}"
    )


def _kind(value: Any) -> str:
    """Return the tag of a block's ``kind``, which is ``frames`` by default."""
    if isinstance(value, dict):
        return f"<{value.get('kind', 'frames')}>"
    return f"<{getattr(value, 'kind', 'frames')}>"


BY_KIND = Discriminator(
    _kind,
    custom_error_type=UNKNOWN_KIND,
    custom_error_message=", ".join(f"'{tag.strip('<>')}'" for tag in sorted(KINDS)),
)
"""Picks the branch of a union of blocks by their ``kind``."""


def _sheets_kind(value: Any) -> str:
    """Return the tag of an entry of a list of sheets: an arrangement has the key of that name, or
    ``on``."""
    if isinstance(value, dict):
        return ARRANGEMENT.tag if value.keys() & {"arrangement", "on"} else SHEET.tag
    return ARRANGEMENT.tag if hasattr(value, "arrangement") else SHEET.tag


BY_ARRANGEMENT = Discriminator(_sheets_kind)
"""Picks the branch of a union of single sheets and arrangements of several."""
