"""Write movies by the names of their formats; each writer is imported only when it is named."""

from typing import assert_never

from fire_atlas.core.errors import OutputError
from fire_atlas.formats.movies.movie import Movie
from fire_atlas.recipe.output import MovieName

_MAX_SIDE: dict[MovieName, int] = {"webp": 16383, "gif": 65535, "mp4": 8192, "webm": 65535}
"""Maximum side of a frame, px: what headers or encoders can state. An MP4 is twice as wide."""


def write_movie(name: MovieName, movie: Movie) -> bytes:
    """Return the file of a movie in the format of that name.

    Raises:
        OutputError: The format cannot hold the movie.
    """
    most = _MAX_SIDE.get(name)
    if most is not None and max(movie.width, movie.height) > most:
        raise OutputError(
            f"movies: {name}: frames have at most {most} px a side, but these are {movie.width}x"
            f"{movie.height}; use another format, or a smaller source.height"
        )
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
