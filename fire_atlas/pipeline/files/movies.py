"""Make the movies of a build: each animation as it is on the pages, in whole frames."""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from fire_atlas.atlas.encode import as_straight, over_smoke
from fire_atlas.atlas.sheet import AtlasSheet, Region, Sprite, common_canvas
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import OutputFile, as_file_name
from fire_atlas.core.pixels import Bytes
from fire_atlas.formats.movies.movie import Movie
from fire_atlas.formats.output_names import animation_stem
from fire_atlas.pipeline.animation.contribution import FinishedAnimation
from fire_atlas.pipeline.pages.content import PageContent
from fire_atlas.recipe.output import MovieName

if TYPE_CHECKING:
    from fire_atlas.pipeline.pages.heat import HeatPages


def movie_files(
    movies: Sequence[MovieName],
    sheet: AtlasSheet,
    content: PageContent,
    context: BuildContext,
) -> Iterator[OutputFile]:
    """Yield a movie of each animation in each of ``movies``, at full size.

    Args:
        movies: Formats, as in the recipe.
        sheet: The pages at full size.
        content: The animations, in the order in which they were packed.
        context: What the build works with.

    Raises:
        OutputError: A format cannot hold an animation.
    """
    if not movies:
        return
    if not content.animations:
        context.progress.note("movies: single sprites have none, and there is no animation here")
    elif sheet.alpha == "additive" or sheet.thins:
        context.progress.note(
            f"movies: no player adds the light of a movie, as clients do that of pages with "
            f"atlas.alpha: {sheet.alpha}; over something bright it is less bright"
        )
    from fire_atlas.formats.movies.write import write_movie

    regions, shown = iter(sheet.regions), dict[str, Movie]()
    for title, animation in content.animations.items():
        places = tuple(islice(regions, len(animation.frames)))
        stem = animation_stem(sheet.title, title)
        if as_file_name(stem) in map(as_file_name, shown):
            raise OutputError(
                f"movies: the movie of {title} would be the file of another animation, {stem}; "
                f"rename the files of one"
            )
        shown[stem] = _movie(animation, places, sheet, content.heat)
        if animation.tracks and not animation.bakes_flakes:
            context.progress.note(f"movies: {title} has no flakes there, as flakes.bake is false")
    named = [(stem, name) for stem in shown for name in movies]
    context.progress.stage("movies", len(named))
    written = context.workers.map(lambda movie: write_movie(movie[1], shown[movie[0]]), named)
    for (stem, name), data in zip(named, written, strict=True):
        yield OutputFile(f"{stem}.{name}", "movie", data)
        context.progress.advance()


def _movie(
    animation: FinishedAnimation,
    regions: Sequence[Region],
    sheet: AtlasSheet,
    heat: "HeatPages | None",
) -> Movie:
    """Return an animation as a movie, its frames aligned at their pivots; heat has the colours of
    the first ramp."""
    (width, height), places = common_canvas(regions)
    sprites = [frame.sprites[0] for frame in animation.frames]
    under = [frame.under() for frame in animation.frames]

    def frame(i: int) -> Bytes:
        whole = _on_canvas(sprites[i], places[i], width, height)
        whole = whole if heat is None else heat.colours(whole, i)
        for kept in under[i]:
            below = _on_canvas(kept, places[i], width, height)
            whole = over_smoke(whole, below, sheet.alpha, sheet.blend_space)
        return as_straight(whole, sheet.alpha, sheet.blend_space)

    durations = tuple(region.duration for region in regions)
    return Movie(width, height, durations, animation.loop, frame)


def _on_canvas(sprite: Sprite, place: tuple[int, int], width: int, height: int) -> Bytes:
    """Return a canvas (height, width, 4) with a frame whose top-left corner is at ``place``."""
    canvas = np.zeros((height, width, 4), np.uint8)
    left, top = place[0] + sprite.x, place[1] + sprite.y
    rows, columns = sprite.image.shape[:2]
    canvas[top : top + rows, left : left + columns] = sprite.image
    return canvas
