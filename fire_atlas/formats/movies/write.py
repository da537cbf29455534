"""Write a movie in the format that a recipe names."""

from fire_atlas.core.errors import OutputError
from fire_atlas.formats.movies.movie import Movie
from fire_atlas.formats.tables import MOVIES
from fire_atlas.recipe.output import MovieName


def write_movie(name: MovieName, movie: Movie) -> bytes:
    """Return the file of a movie in the format of that name.

    Raises:
        OutputError: The format cannot hold the movie.
    """
    format_ = MOVIES[name]
    most = format_.max_side
    if most is not None and max(movie.width, movie.height) > most:
        raise OutputError(
            f"{name}: frames have at most {most} px a side, but these are {movie.width}x"
            f"{movie.height}; use another format, or a smaller source.height",
            key=("movies",),
        )
    data: bytes = format_.write(movie)
    return data
