"""The flakes of a build beside filmed embers: each figure, and its range in five clips of footage.

Run it from the checkout: ``python -m tools.bench.embers build/NAME.json``. The recipe needs
``tracks: [json]``, and soft flakes: hard squares and pictures were filmed by nobody.
"""

import sys
from math import isnan
from pathlib import Path

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Column, Table

from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.formats.tracks.tracks_json import read_all_tracks
from fire_atlas.preview.figures import range_text
from tests.support.filmed.close_ups import HEIGHT
from tests.support.filmed.footage import compare_with_filmed, is_hard


def table_of(tracks: Tracks, title: str) -> Table:
    """Return the figures of soft flakes beside those of footage."""
    caption = (
        f"each flake drawn alone, in frames {HEIGHT} px high; colours and peaks 0-255, sRGB; "
        "filmed: five clips at 24 frames/s, whose embers a tracker followed and often lost"
    )
    heads = (Column("", no_wrap=True), "here", "filmed", "should be", "")
    table = Table(*heads, title=title, caption=caption, box=SIMPLE, padding=(0, 0, 0, 1))
    for section, figures in compare_with_filmed(tracks).items():
        table.add_row(section, style="bold")
        for figure in figures:
            table.add_row(
                f"  {figure.row.label}",
                "-" if isnan(figure.value) else f"{figure.value:.3g}",
                range_text(*(figure.row.filmed or (None, None))),
                range_text(*(figure.row.target or (None, None))),
                "outside" if figure.is_outside else "",
            )
    return table


def main() -> None:
    """Print a table for each animation with soft flakes."""
    console = Console()
    for name, tracks in read_all_tracks(read_atlas(Path(sys.argv[1]))).items():
        if is_hard(tracks):
            console.print(f"{name}: its flakes are hard squares, as none were filmed")
        else:
            console.print(table_of(tracks, f"flakes of {name} beside filmed embers"))


if __name__ == "__main__":
    main()
