"""The command ``inspect``: describe a built atlas in tables."""

import json
from argparse import Namespace
from pathlib import Path

from fire_atlas.cli.console import PlainConsole
from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import read_file
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.templates.context import context_of
from fire_atlas.formats.tracks.tracks_json import read_all_tracks
from fire_atlas.outputs.manifest import MAX_MANIFEST_BYTES, decode_manifest, manifest_name
from fire_atlas.preview.singles import with_singles_played
from fire_atlas.preview.tables import BuildSentences, tables_of


def run(args: Namespace) -> int:
    """Print tables about a built atlas, or the context that templates get of it."""
    atlas = read_atlas(args.subject)
    if args.context:
        print(json.dumps(context_of(atlas.sheet), indent=2))
        return 0
    sentences = _sentences(args.subject.parent / manifest_name(atlas.sheet.title))
    console = PlainConsole()
    atlas = with_singles_played(atlas)
    for table in tables_of(atlas, read_all_tracks(atlas), sentences):
        console.print(table)
    return 0


def _sentences(manifest: Path) -> BuildSentences:
    """Return what a manifest says of the build; nothing if it is missing.

    Raises:
        SourceError: It is damaged.
    """
    if not manifest.exists():
        return BuildSentences()
    try:
        data = read_file(manifest, MAX_MANIFEST_BYTES)
        return BuildSentences.of(decode_manifest(data).statistics)
    except (OSError, ValueError) as error:
        raise SourceError(
            f"{manifest}: is not a manifest that fire-atlas wrote ({type(error).__name__}: {error})"
            f"; build the recipe again"
        ) from error
