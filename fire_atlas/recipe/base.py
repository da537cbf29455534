"""What all recipe models share: strictness, choices between kinds of value, colours."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag


class Settings(BaseModel):
    """A block of a recipe: immutable, unknown keys refused, NaN and infinities refused.

    Strict: ``"80"`` and ``yes`` are no numbers.
    """

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        allow_inf_nan=False,
        defer_build=True,  # blocks are built once, as parts of the recipe: not alone as well
    )


def ordered(value: tuple[float, float]) -> tuple[float, float]:
    """Validate a [min, max] pair."""
    if value[0] > value[1]:
        raise ValueError(f"the first number must not exceed the second; got {list(value)}")
    return value


def none_of_off(value: Any) -> Any:
    """Read ``off``, ``no`` (to PyYAML: false) and ``~`` (null) as the word ``none``."""
    return "none" if value is False or value is None else value


OFF = BeforeValidator(none_of_off)
"""Goes with every choice that has the word ``none``."""

LIST = Field(strict=False)
"""Goes with every tuple: YAML only knows lists."""

COLOR_PATTERN = r"^#[0-9a-fA-F]{6}$"

Color = Annotated[str, Field(pattern=COLOR_PATTERN)]
"""An sRGB colour like ``#ff7300``."""

Direction = Annotated[
    tuple[Annotated[float, Field(ge=-100, le=100)], Annotated[float, Field(ge=-100, le=100)]], LIST
]
"""[x, y]: x right, y up, as an artist thinks of it."""


# Where a key takes one kind of value or another, the branch is chosen by looking at the value, so
# that a mistake is explained in terms of what was meant. The tags never reach a person.

NONE, BLOCK = Tag("<none>"), Tag("<block>")
AUTO, NUMBER, PAIR = Tag("<auto>"), Tag("<number>"), Tag("<pair>")
WORD, SWITCH = Tag("<word>"), Tag("<switch>")
TEMPLATE, GODOT, UNITY = Tag("<template>"), Tag("<godot>"), Tag("<unity>")
FRAMES, PROFILE, SILK = Tag("<frames>"), Tag("<profile>"), Tag("<silk>")
KINDS = frozenset(tag.tag for tag in (FRAMES, PROFILE, SILK))
"""Tags of a source's kind."""
BRANCHES = KINDS | {
    tag.tag for tag in (NONE, BLOCK, AUTO, NUMBER, PAIR, WORD, SWITCH, TEMPLATE, GODOT, UNITY)
}
"""All tags, as they appear in the paths of pydantic's errors."""

UNDECIDED = "undecided"
"""Type of the error about a value that fits no branch."""

UNKNOWN_KIND = "unknown_kind"
"""Type of the error about a block whose ``kind`` there is not; its message lists what there is."""

Auto = Annotated[Literal["auto"], AUTO]
"""The word ``auto``, in a choice with a number."""

Off = Annotated[Literal["none"], NONE]
"""The word ``none``, in a choice with a block."""


def _branch(value: Any) -> str | None:
    match value:
        case "none":
            return NONE.tag
        case "auto":
            return AUTO.tag
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
    """Return what picks the branch of a union; ``kinds`` names the branches in an error."""
    return Discriminator(
        _branch, custom_error_type=UNDECIDED, custom_error_message=f"must be {kinds}"
    )


def _kind(value: Any) -> str:
    """Return the tag of a block's ``kind``; a block that does not say is of frames."""
    if isinstance(value, dict):
        return f"<{value.get('kind', 'frames')}>"
    return f"<{getattr(value, 'kind', 'frames')}>"


BY_KIND = Discriminator(
    _kind,
    custom_error_type=UNKNOWN_KIND,
    custom_error_message=", ".join(f"'{tag.strip('<>')}'" for tag in sorted(KINDS)),
)
"""What picks the branch of a union of blocks by their ``kind``."""
