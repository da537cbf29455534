"""Style of a fire: how it was drawn or filmed, by its colours and its edges."""

from typing import NamedTuple

from fire_atlas.effect.flame.classes import GREY, GREY_FIRE, FlameMeasures, hue_name
from fire_atlas.recipe.effect import FlakeStyle

_FEW_COLOURS, _FLAT_COLOURS, _PIXEL_COLOURS = 0.82, 400, 64
"""Minimum share of a frame's most frequent colours in flat art, and maximum number of all colours
in flat art and in pixel art."""

_PIXEL_SIDE, _PIXEL_SOFT = 128, 0.05
"""Maximum side of pixel art, px, and maximum share of its pixels that are half transparent."""


class Styled(NamedTuple):
    """The style of a fire, and why, as a clause for the user."""

    style: FlakeStyle
    reason: str


def style_of(flame: FlameMeasures) -> Styled:
    """Return the style of a fire: the first that fits, from those that are easiest to tell."""
    colours, hue = flame.colours, hue_name(flame.colours.hue)
    if colours.few >= _FEW_COLOURS and colours.count <= _FLAT_COLOURS:
        drawn = f"{hue} flame in {colours.count:.0f} colours"
        width, height = flame.width // flame.art_side, flame.height // flame.art_side
        is_small = max(width, height) <= _PIXEL_SIDE and colours.soft < _PIXEL_SOFT
        if is_small and colours.count <= _PIXEL_COLOURS:
            enlarged = f", each enlarged to {flame.art_side}" if flame.art_side > 1 else ""
            return Styled("pixel", f"{drawn}, with hard edges, {width} x {height} px{enlarged}")
        return Styled("cartoon", f"{drawn}, drawn in flat areas")
    if colours.chroma < GREY and colours.peak >= GREY_FIRE:
        return Styled("grey", "fire without colour, to be tinted")
    if flame.outlined:
        return Styled("anime", f"{hue} flame in soft shades that ends at an outline")
    if colours.chroma >= GREY and colours.warmth < 0.5:
        return Styled("anime", f"{hue} flame, no colour of real fire")
    return Styled("film", "shades and edges as of light")
