"""What the scenes for Godot do not show of a build, and what would let them."""

from collections.abc import Iterator

from fire_atlas.engines.godot.flake_player import why_texture_is_not_played
from fire_atlas.engines.godot.flipbook import why_motion_is_not_played
from fire_atlas.engines.godot.heat import why_heat_is_drawn_alone
from fire_atlas.engines.godot.smoke import why_smoke_is_not_shown
from fire_atlas.formats.product import Product

_REASONS = (
    why_motion_is_not_played,
    why_texture_is_not_played,
    why_smoke_is_not_shown,
    why_heat_is_drawn_alone,
)


def what_is_not_shown(product: Product) -> Iterator[str]:
    """Yield advice for each part of a build that the scenes leave out."""
    for why in _REASONS:
        if advice := why(product):
            yield advice
