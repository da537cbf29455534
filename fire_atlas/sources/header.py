"""What the header of an image file says about its picture."""

from dataclasses import dataclass

from fire_atlas.sources.colours import AS_SRGB, Conversion, FileColours
from fire_atlas.sources.exr import ExrPicture
from fire_atlas.sources.orientation import IN_WORDS, UPRIGHT, turned_size


@dataclass(frozen=True, slots=True)
class Header:
    """What is known of a picture before a pixel of it is decoded.

    Attributes:
        format: ``png``, ``gif``, ``webp``, ``jpeg``, ``tiff``, ``bmp``, ``tga`` or ``exr``.
        width, height: Size of the upright picture, px.
        orientation: How it is stored, 1..8 as in EXIF.
        conversion: What turns its colours into sRGB; None if they are.
        exr: Which picture of an EXR file it is; None for other formats.
        notes: What is unusual about it, and what is done about that, for the user.
    """

    format: str
    width: int
    height: int
    orientation: int = UPRIGHT
    conversion: Conversion | None = None
    exr: ExrPicture | None = None
    notes: tuple[str, ...] = ()

    @classmethod
    def of_stored(
        cls,
        format: str,
        size: tuple[int, int],
        orientation: int = UPRIGHT,
        colours: FileColours = AS_SRGB,
    ) -> "Header":
        """Return the header of a picture that is stored as width x height, px, in these colours."""
        turn = IN_WORDS.get(orientation)
        notes = (*([f"it is shown {turn}, as it states"] if turn else []), *colours.notes)
        width, height = turned_size(*size, orientation)
        return cls(format, width, height, orientation, colours.conversion, notes=notes)
