"""Rounds of a loop after which its flakes repeat: a short loop of flame may carry long lives."""

import math

from fire_atlas.core.clip import Clip
from fire_atlas.recipe.effect import MAX_ROUNDS, Flakes


def rounds_of(flakes: Flakes, clip: Clip, *, in_pages: bool) -> int:
    """Return how many rounds of a clip the tracks of its flakes cover.

    By default the tracks are at least as long as the longest life, so that no flake is in sight
    beside its own repetition.

    Args:
        flakes: The recipe's section.
        clip: The clip; one that plays once has one round.
        in_pages: Whether pages show the flakes; pages have one round.
    """
    if in_pages or not clip.loop:
        return 1
    if flakes.rounds != "auto":
        return flakes.rounds
    return min(math.ceil(flakes.life[1] * clip.fps / clip.count), MAX_ROUNDS)
