"""What a recipe may name in ``exports``, ``tracks`` and ``movies``: a row for each format.

To add a format: its name in ``recipe/output.py``, a module with its writer, and a row here. Engines
are in ``engines/engine.py``. Kept free of heavy imports: a writer is imported when it is asked for.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from fire_atlas.recipe.output import FlakeTrackName, MovieName


@dataclass(frozen=True, slots=True)
class Format:
    """A format of files.

    Attributes:
        ending: What ends the names of its files.
        module: The module below ``formats`` that writes it.
        function: The function there: of an export, from an ``AtlasSheet`` to ``OutputFile``s; of
            tracks, from a file stem and ``Tracks`` to an ``OutputFile``; of a movie, from a
            ``Movie`` to bytes.
        of_each_page: Whether an export writes a file for each page, not one for all.
        max_side: Maximum side of a frame of a movie, px, that headers or encoders can state; None
            if there is none. An MP4 is twice as wide.
    """

    ending: str
    module: str
    function: str
    of_each_page: bool = False
    max_side: int | None = None

    @property
    def write(self) -> Callable[..., Any]:
        """What writes it."""
        writer: Callable[..., Any] = getattr(
            import_module(f"fire_atlas.formats.{self.module}"), self.function
        )
        return writer


EXPORTS: Mapping[str, Format] = {
    "json": Format(".json", "atlas.texture_packer", "export_json_hash", of_each_page=True),
    "json-array": Format(
        ".array.json", "atlas.texture_packer", "export_json_array", of_each_page=True
    ),
    "phaser": Format(".phaser.json", "atlas.phaser", "export_phaser"),
    "aseprite": Format(".aseprite.json", "atlas.texture_packer", "export_aseprite"),
    "css": Format(".css", "templates.export", "export_css"),
    "tpsheet": Format(".tpsheet", "templates.export", "export_tpsheet", of_each_page=True),
}
"""Descriptions of the pages of one scale, for no single engine."""

TRACKS: Mapping[FlakeTrackName, Format] = {
    "json": Format(".flakes.json", "tracks.tracks_json", "write_tracks_json"),
    "csv": Format(".flakes.csv", "tracks.tracks_csv", "write_tracks_csv"),
    "pcache": Format(".flakes.pcache", "tracks.pcache", "write_tracks_pcache"),
    "hjson": Format(".flakes.hjson", "tracks.hjson", "write_tracks_hjson"),
}
"""Files of the flakes of an animation."""

MOVIES: Mapping[MovieName, Format] = {
    "webp": Format(".webp", "movies.images", "webp", max_side=16383),
    "apng": Format(".apng", "movies.images", "apng"),
    "gif": Format(".gif", "movies.images", "gif", max_side=65535),
    "webm": Format(".webm", "movies.video", "webm", max_side=65535),
    "mp4": Format(".mp4", "movies.video", "mp4", max_side=8192),
}
"""Movies of an animation."""
