"""Write movies by the names of their formats; each writer is imported only when it is named."""

from typing import assert_never

from fire_atlas.formats.movies.movie import Movie
from fire_atlas.recipe.output import MovieName


def write_movie(name: MovieName, movie: Movie) -> bytes:
    """Return the file of a movie in the format of that name.

    Raises:
        OutputError: The format cannot hold the movie.
    """
    match name:
        case "webp":
            from fire_atlas.formats.movies.images import webp

            return webp(movie)
        case "apng":
            from fire_atlas.formats.movies.images import apng

            return apng(movie)
        case "gif":
            from fire_atlas.formats.movies.images import gif

            return gif(movie)
        case "webm":
            from fire_atlas.formats.movies.video import webm

            return webm(movie)
        case "mp4":
            from fire_atlas.formats.movies.video import mp4

            return mp4(movie)
        case _:
            assert_never(name)
