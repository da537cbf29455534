"""What a build made, as the exporters of engines see it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.effect.composition.light import ClipLight
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.tracks.names import stem_of
from fire_atlas.recipe.output import TrackName


@dataclass(frozen=True, slots=True)
class Product:
    """Pages in all scales, flakes, and what lies where the files will go.

    Attributes:
        sheets: The atlas in each scale, full size first.
        tracks: The flakes of each animation that has any, by its name.
        baked: Names of the animations whose flakes are in the pixels too: a client that plays
            their tracks as well would show them twice.
        existing: ``existing(name)`` gives the file of that name in the output folder, as the last
            build, its engine or a person left it; None where there is none. For files that engines
            write into as well: what is theirs has to survive.
        track_formats: The forms in which flakes are written beside.
        lights: The light of each animation where it was measured, by its name.
    """

    sheets: tuple[AtlasSheet, ...]
    tracks: Mapping[str, Tracks]
    baked: frozenset[str]
    existing: Callable[[str], bytes | None]
    track_formats: tuple[TrackName, ...] = ()
    lights: Mapping[str, ClipLight] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """File stem of the outputs."""
        return self.sheets[0].title

    def stem(self, animation: str) -> str:
        """File stem of what belongs to one animation: the outputs' own where it is the only one."""
        return stem_of(self.name, animation)
