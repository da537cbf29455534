"""A fire that changes in a game: the frames of a build, and its graph of states."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

from fire_atlas.atlas.sheet import StateGraph
from fire_atlas.core.pixels import Bytes, Pixels
from fire_atlas.formats.atlas.texture_packer import AtlasFile, read_atlas
from fire_atlas.preview.blend import as_seen
from fire_atlas.preview.cut_frames import cut_frames
from fire_atlas.vision.thumbnails import distance

Place = tuple[str, int]
"""An animation and the number of a frame in it."""


@dataclass(frozen=True)
class GraphWalker:
    """The frames of a finished build, and what leads from one to the next."""

    atlas: AtlasFile

    @classmethod
    def of(cls, json_file: Path) -> Self:
        return cls(read_atlas(json_file))

    @property
    def graph(self) -> StateGraph:
        assert self.atlas.sheet.states is not None
        return self.atlas.sheet.states

    @cached_property
    def cuts(self) -> dict[Place, Bytes]:
        """All frames, as they are in the file."""
        animations = self.atlas.sheet.animations
        places = [(each.name, i) for each in animations for i in range(len(each.frames))]
        return dict(zip(places, cut_frames(self.atlas), strict=True))

    @cached_property
    def frames(self) -> dict[Place, Pixels]:
        """All frames, in linear light."""
        sheet = self.atlas.sheet
        return {
            place: as_seen(cut, sheet.alpha, sheet.blend_space) for place, cut in self.cuts.items()
        }

    def count(self, animation: str) -> int:
        return sum(name == animation for name, _ in self.cuts)

    def step(self, one: Place, other: Place) -> float:
        return distance(self.frames[one], self.frames[other])
