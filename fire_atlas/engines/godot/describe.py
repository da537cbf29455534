"""The sheet in Godot's words: textures with margins, and animations that show them."""

from dataclasses import dataclass

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.engines.godot.stage import Margin, Stage
from fire_atlas.engines.godot.tempo import tempo, whole_tempo
from fire_atlas.engines.godot.text import titles
from fire_atlas.recipe.output import GodotOptions


@dataclass(frozen=True, slots=True)
class Texture:
    """A part of a page, and what is around it. px, y down."""

    page: int
    x: int
    y: int
    width: int
    height: int
    margin: Margin


@dataclass(frozen=True, slots=True)
class Shown:
    """A texture, and for how many ticks an animation shows it."""

    texture: int
    ticks: float


@dataclass(frozen=True, slots=True)
class Animation:
    """An animation: its title, its speed in ticks per second, and what it shows."""

    title: str
    loop: bool
    speed: float
    frames: tuple[Shown, ...]


def textures_of(sheet: AtlasSheet) -> tuple[list[Texture], dict[str, int]]:
    """Return the textures, each once, and which of them each frame shows."""
    stage = Stage.of(sheet.regions)
    made: dict[Texture, int] = {}
    shown = {}
    for region in sheet.regions:
        texture = Texture(
            region.page, region.x, region.y, region.width, region.height, stage.margin(region)
        )
        shown[region.name] = made.setdefault(texture, len(made))
    return list(made), shown


def animations_of(
    sheet: AtlasSheet, shown: dict[str, int], options: GodotOptions
) -> list[Animation]:
    """Return the animations. Godot 3 shows all frames for one tick: longer ones are repeated."""
    durations = {region.name: region.duration for region in sheet.regions}
    named = titles(animation.name for animation in sheet.animations)
    made = []
    for animation in sheet.animations:
        measure = tempo if options.version == 4 else whole_tempo
        speed, ticks = measure([durations[frame] for frame in animation.frames])
        frames = (
            Shown(shown[frame], count) for frame, count in zip(animation.frames, ticks, strict=True)
        )
        if options.version == 3:
            frames = (Shown(each.texture, 1) for each in frames for _ in range(int(each.ticks)))
        made.append(Animation(named[animation.name], animation.loop, speed, tuple(frames)))
    return made
