"""What all recipe models share."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field


class Settings(BaseModel):
    """A block of a recipe: immutable, unknown keys refused, NaN and infinities refused."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


def _none_of_off(value: Any) -> Any:
    """PyYAML reads a bare ``off`` or ``no`` as false, and ``~`` as null: all mean ``none``."""
    return "none" if value is False or value is None else value


Off = Annotated[Literal["none"], BeforeValidator(_none_of_off)]
"""The word ``none`` (or YAML's ``off``) where a block can be switched off."""


def _ordered(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] > value[1]:
        raise ValueError(f"the first number must not exceed the second; got {list(value)}")
    return value


Direction = tuple[
    Annotated[float, Field(ge=-100, le=100)], Annotated[float, Field(ge=-100, le=100)]
]
"""[x, y]: x right, y up, as an artist thinks of it."""
