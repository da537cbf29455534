"""Find the views and the variants of a fire among the animations of an atlas, which may be shown
together."""

import re
from collections import defaultdict
from collections.abc import Sequence

from fire_atlas.atlas.sheet import Animation, AtlasSheet, common_canvas

_VIEW = re.compile(r"(.*/)?view_\d+")


def fires_together(sheet: AtlasSheet) -> list[list[int]]:
    """Return the views of each fire that has several, and else its variants, as numbers of
    animations.

    They are called alike but for their numbers, and can be shown side by side and in step: they
    have frames of the same times, and stages of one size.
    """
    regions = {region.name: region for region in sheet.regions}
    fires = defaultdict(list)
    for number, animation in enumerate(sheet.animations):
        if named := _named_alike(animation):
            frames = [regions[name] for name in animation.frames]
            times = tuple(frame.duration for frame in frames)
            fires[named, animation.loop, times, common_canvas(frames)[0]].append(number)
    return [fire for fire in fires.values() if len(fire) > 1]


def _named_alike(animation: Animation) -> tuple[str, str] | None:
    """Return what the names of a fire's views, or else of its variants, have in common: before
    their number and after it. None if there are neither."""
    if view := _VIEW.fullmatch(animation.name):
        return view[1] or "", "view"
    if animation.variant is None:
        return None
    return animation.stem.rpartition("/")[0], animation.name.removeprefix(animation.stem)


def choices_of(sheet: AtlasSheet, fires: Sequence[Sequence[int]]) -> dict[str, str]:
    """Return what can be shown, by the values that ``controls.js`` reads: every animation alone, by
    its number, and before the first view or variant of a fire all of them."""
    choices = {}
    for number, animation in enumerate(sheet.animations):
        for together in fires:
            if number == together[0]:
                begin, end = _named_alike(animation) or ("", "")
                fire = begin.rstrip("/") if end == "view" else f"{begin}{end}".strip("/")
                kind = kind_of(animation)
                choices[f"{number} on"] = f"{fire}{': ' if fire else ''}all {len(together)} {kind}"
        choices[str(number)] = animation.name
    return choices


def kind_of(animation: Animation) -> str:
    """Return what an animation that is shown with others is one of."""
    return "views" if _VIEW.fullmatch(animation.name) else "variants"
