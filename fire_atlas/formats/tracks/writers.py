"""Find the function that writes the flakes in a format that a recipe names in ``tracks``.

A new format is a module and a case here; the type checker demands the case once the name is in
``fire_atlas.recipe.output``. Writers are imported only when a recipe names them.
"""

from collections.abc import Callable
from typing import TypeAlias, assert_never

from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.recipe.output import FlakeTrackName

TrackWriter: TypeAlias = Callable[[str, Tracks], OutputFile]
"""Returns the file of an animation's flakes, from its file stem and tracks."""


def track_writer(name: FlakeTrackName) -> TrackWriter:
    """Return the writer of flake tracks that a recipe calls ``name``."""
    match name:
        case "json":
            from fire_atlas.formats.tracks.tracks_json import write_tracks_json

            return write_tracks_json
        case "csv":
            from fire_atlas.formats.tracks.tracks_csv import write_tracks_csv

            return write_tracks_csv
        case "pcache":
            from fire_atlas.formats.tracks.pcache import write_tracks_pcache

            return write_tracks_pcache
        case "hjson":
            from fire_atlas.formats.tracks.hjson import write_tracks_hjson

            return write_tracks_hjson
        case _:
            assert_never(name)
