"""Find the views of a fire among the animations of an atlas, which may be shown together."""

import re
from collections import defaultdict
from collections.abc import Sequence

from fire_atlas.atlas.sheet import AtlasSheet, common_canvas

_VIEW = re.compile(r"(.*/)?view_\d+")


def fires_in_views(sheet: AtlasSheet) -> list[list[int]]:
    """Return the views of each fire that has several, as numbers of animations.

    They are called alike but for their numbers, and can be shown side by side and in step: they
    have frames of the same times, and stages of one size.
    """
    regions = {region.name: region for region in sheet.regions}
    fires = defaultdict(list)
    for number, animation in enumerate(sheet.animations):
        if named := _VIEW.fullmatch(animation.name):
            frames = [regions[name] for name in animation.frames]
            times = tuple(frame.duration for frame in frames)
            fires[named[1], animation.loop, times, common_canvas(frames)[0]].append(number)
    return [views for views in fires.values() if len(views) > 1]


def choices_of(sheet: AtlasSheet, fires: Sequence[Sequence[int]]) -> dict[str, str]:
    """Return what can be shown, by the values that ``controls.js`` reads: every animation alone, by
    its number, and before the first view of a fire all of its views."""
    choices = {}
    for number, animation in enumerate(sheet.animations):
        for views in fires:
            if number == views[0]:
                fire = animation.name.rpartition("/")[0]
                choices[f"{number} on"] = f"{fire}{': ' if fire else ''}all {len(views)} views"
        choices[str(number)] = animation.name
    return choices
