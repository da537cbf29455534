"""The result of a build, which exporters and track writers read."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.camera import Camera
from fire_atlas.effect.composition.light import ClipLight
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.output_names import animation_stem
from fire_atlas.recipe.output import TrackName


@dataclass(frozen=True, slots=True)
class Product:
    """Pages in all scales, flakes and light, and the files already in the output folder.

    Attributes:
        sheets: The atlas in each scale, full size first.
        tracks: The flakes of each animation that has any, by its name; of several sets the first.
        baked: Names of the animations whose flakes are also drawn into the pages: a client that
            plays their tracks too would show them twice.
        existing: ``existing(name)`` returns the content of a file in the output folder, None if
            there is none. Engines and users edit import settings, and their edits are kept.
        track_formats: Formats in which the flake tracks are written.
        lights: The light of each animation whose light was measured, by its name.
        pixel_art: Whether all is pixel art, whose pixels stay sharp when they are shown larger.
        cameras: The camera that sees each animation of a fire with depth, by its name.
        other_tracks: The other sets of flakes of each animation that has more than one.
    """

    sheets: tuple[AtlasSheet, ...]
    tracks: Mapping[str, Tracks]
    baked: frozenset[str]
    existing: Callable[[str], bytes | None]
    track_formats: tuple[TrackName, ...] = ()
    lights: Mapping[str, ClipLight] = field(default_factory=dict)
    pixel_art: bool = False
    cameras: Mapping[str, Camera] = field(default_factory=dict)
    other_tracks: Mapping[str, Sequence[Tracks]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """File stem of the outputs."""
        return self.sheets[0].title

    def stem(self, animation: str) -> str:
        """Return the stem for files of one animation; see ``names.animation_stem``."""
        return animation_stem(self.name, animation)

    def all_tracks(self, animation: str) -> tuple[Tracks, ...]:
        """Return every set of the flakes of an animation."""
        return self.tracks[animation], *self.other_tracks.get(animation, ())

    def track_stems(self) -> Iterator[tuple[str, Tracks]]:
        """Yield the stem for the files of each set of flakes of each animation, and the set."""
        for animation in self.tracks:
            for number, tracks in enumerate(self.all_tracks(animation)):
                yield self.stem(animation) + (f".v{number}" if number else ""), tracks
