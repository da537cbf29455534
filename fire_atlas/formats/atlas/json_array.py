"""TexturePacker's JSON array: as the hash, with the frames as a list."""

from collections.abc import Iterator, Sequence

from fire_atlas.atlas.sheet import AtlasSheet, Region
from fire_atlas.core.output_file import OutputFile
from fire_atlas.formats.atlas.entries import animations_on, compact, frame_entry, meta_entry


def export_json_array(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield ``name.array.json``, ``name-1.array.json``, ...: each describes one page."""
    for page in range(len(sheet.pages)):
        regions = sheet.regions_of(page)
        text = array_text(sheet, page, regions, [region.name for region in regions])
        yield OutputFile(sheet.file(page, ".array.json"), "atlas", text.encode())


def array_text(
    sheet: AtlasSheet, page: int, regions: Sequence[Region], names: Sequence[str]
) -> str:
    """Return the JSON of a page whose frames are called ``names``."""
    frames = ",\n".join(
        compact({"filename": name, **frame_entry(region)})
        for name, region in zip(names, regions, strict=True)
    )
    called = {region.name: name for name, region in zip(names, regions, strict=True)}
    animations = {
        animation: [called[frame] for frame in played]
        for animation, played in animations_on(sheet, regions).items()
    }
    return (
        f'{{"frames":[\n{frames}\n],\n'
        f'"animations":{compact(animations)},\n'
        f'"meta":{compact(meta_entry(sheet, page, regions))}}}\n'
    )
