"""TexturePacker's JSON hash, as PixiJS, Phaser and most engines read it: one file a page."""

from collections.abc import Iterator

from fire_atlas.atlas.layout import AtlasSheet
from fire_atlas.core.output_file import OutputFile
from fire_atlas.formats.atlas.entries import animations_on, compact, frame_entry, meta_entry


def export_json_hash(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield ``name.json``, ``name-1.json``, ...: each describes one page."""
    for page in range(len(sheet.pages)):
        text = _page_text(sheet, page)
        yield OutputFile(sheet.file(page, ".json"), "atlas", text.encode())


def _page_text(sheet: AtlasSheet, page: int) -> str:
    """Return the page's JSON with one frame a line: small, and good to look at in a diff."""
    regions = sheet.regions_of(page)
    frames = ",\n".join(
        f"{compact(region.name)}:{compact(frame_entry(region))}" for region in regions
    )
    meta = meta_entry(sheet, page, regions)
    if page == 0 and len(sheet.pages) > 1:  # only the first links to the others
        meta["related_multi_packs"] = [sheet.file(i, ".json") for i in range(1, len(sheet.pages))]
    return (
        f'{{"frames":{{\n{frames}\n}},\n'
        f'"animations":{compact(animations_on(sheet, regions))},\n'
        f'"meta":{compact(meta)}}}\n'
    )
