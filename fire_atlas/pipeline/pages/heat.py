"""Turn finished animations into heat, and make the ramps that give their colours back."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fire_atlas.atlas.sheet import CHANNELS, RAMP_WIDTH, AtlasSheet, Heat, Rect, Sprite
from fire_atlas.atlas.trim import bounding_rect
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import OutputError, about
from fire_atlas.core.pixels import Bytes
from fire_atlas.heat.encode import SEEN_BELOW, ErrorSums, HeatError, error_sums, heat_of
from fire_atlas.heat.learn import Bins, bins_of, learn_ramp, merged
from fire_atlas.heat.ramp_colours import OwnColours, keeping, shown_of_bytes
from fire_atlas.heat.ready import ramp_of_light, ready_light
from fire_atlas.pipeline.animation.contribution import FinishedAnimation
from fire_atlas.pipeline.animation.render import RenderedFrame
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.output import Atlas
from fire_atlas.recipe.ramps import HEAT_RAMP, LEARNT
from fire_atlas.sources.ramp_image import read_ramp
from fire_atlas.vision.sampling import evenly_spread

_SAMPLES = 8
"""Number of frames by which the flames' own colours are measured."""

_MOST_OFF_RAMP = 0.02
"""Share of an animation's light from which embers of other colours than the ramp's are missed."""


@dataclass(frozen=True, slots=True)
class HeatPages:
    """What gives pages of heat their colours.

    Attributes:
        description: What the sheets say of it: how it lies in the pages, and its ramps.
        ramps: (rows, 256, 4) uint8, encoded as the pages' colours are.
        errors: How well one axis holds the colours of each animation.
    """

    description: Heat
    ramps: Bytes
    errors: Mapping[str, HeatError]

    def colours(self, image: Bytes, i: int) -> Bytes:
        """Return the colours (h, w, 4) by the first ramp of frame ``i`` of an animation, of which
        ``image`` is the heat as its sprite has it."""
        return np.asarray(self.ramps[0][image[..., self.channel(i)]])

    def channel(self, i: int) -> int:
        """Return the index of the channel that has the heat of frame ``i`` of an animation."""
        return i % len(CHANNELS) if self.description.pixels == "heat4" else 0

    def described(self, sheet: AtlasSheet) -> AtlasSheet:
        """Return a sheet that says how its pages get their colours, and of each frame in which
        channel its heat is."""
        regions = sheet.regions
        if self.description.pixels == "heat4":
            numbers = [i for animation in sheet.animations for i in range(len(animation.frames))]
            regions = tuple(
                replace(region, channel=CHANNELS[self.channel(i)])
                for region, i in zip(regions, numbers, strict=True)
            )
        return replace(sheet, regions=regions, heat=self.description)


def in_heat(
    animations: Mapping[str, FinishedAnimation], loaded: LoadedRecipe, context: BuildContext
) -> tuple[dict[str, FinishedAnimation], HeatPages]:
    """Return the animations with sprites of heat, and what gives them their colours.

    One ramp is learnt for all of them, in full size. A sprite of heat has it in its first channel,
    or in ``heat4`` that of four frames in all.

    Raises:
        OutputError: Baked embers have colours that the fire's own ramp lacks.
        SourceError: An image of a ramp cannot be read.
    """
    atlas = loaded.recipe.atlas
    with context.timer.measure("heat"):
        learnt = _learnt(animations, loaded, context)
        made, errors = _all_in_heat(animations, learnt, context)
    if atlas.pixels == "heat4":
        made = {name: _with_shared_sprites(name, animation) for name, animation in made.items()}
    own = _own_colours(animations, atlas)
    ramps = np.stack([_ramp(i, learnt, own, loaded, context) for i in range(len(atlas.ramps))])
    description = Heat(atlas.pixels, f"{loaded.recipe.name}.ramp.png", atlas.ramps)
    return made, HeatPages(description, ramps, errors)


def _all_in_heat(
    animations: Mapping[str, FinishedAnimation], ramp: Bytes, context: BuildContext
) -> tuple[dict[str, FinishedAnimation], dict[str, HeatError]]:
    """Return the animations in heat, and how well it holds their colours; note the worst."""
    made, errors = dict[str, FinishedAnimation](), dict[str, HeatError]()
    for name, animation in animations.items():
        frames, errors[name] = _frames_in_heat(animation, ramp, context)
        _refuse_lost_embers(name, animation, errors[name])
        made[name] = replace(animation, frames=frames)
    _note(errors, context)
    return made, errors


def _learnt(
    animations: Mapping[str, FinishedAnimation], loaded: LoadedRecipe, context: BuildContext
) -> Bytes:
    """Return the ramp of all pixels of all frames."""
    images = [
        frame.sprites[0].image for animation in animations.values() for frame in animation.frames
    ]
    context.progress.stage("heat", 2 * len(images))
    return learn_ramp(
        merged(_counted(context.workers.map(bins_of, images), context)),
        loaded.recipe.atlas.alpha,
        loaded.recipe.atlas.blend_space,
    )


def _counted(parts: Iterable[Bins], context: BuildContext) -> Iterator[Bins]:
    for part in parts:
        context.progress.advance()
        yield part


def _own_colours(animations: Mapping[str, FinishedAnimation], atlas: Atlas) -> OwnColours:
    """Measure the colours of all flames, by which what is no flame keeps its own."""
    images = [
        frame.sprites[0].image for animation in animations.values() for frame in animation.frames
    ]
    few = (images[i] for i in evenly_spread(0, len(images) - 1, _SAMPLES))
    parts = [
        shown_of_bytes(image, atlas.alpha, atlas.blend_space, thins=atlas.thins) for image in few
    ]
    is_matted = atlas.alpha != "additive"
    return OwnColours.of(np.concatenate(parts), atlas.blend_space, is_matted=is_matted)


def _ramp(
    place: int, learnt: Bytes, own: OwnColours, loaded: LoadedRecipe, context: BuildContext
) -> Bytes:
    """Return the ramp that a recipe names at a place of its list, (256, 4), with the ``learnt``
    colours of what is no flame."""
    atlas = loaded.recipe.atlas
    name, key = atlas.ramps[place], HEAT_RAMP
    if name == LEARNT:
        return learnt
    path = loaded.heat_ramps.get((*key, place)) or loaded.heat_ramps.get(key)
    if path is None:
        light = ready_light(name)
    else:
        with about(key):
            light = read_ramp(path, RAMP_WIDTH, atlas.blend_space, context.max_pixels)
    alpha, space, thins = atlas.alpha, atlas.blend_space, atlas.thins
    ramp = ramp_of_light(light, alpha, space, thins=thins)
    return keeping(ramp, learnt, own, alpha, space, thins=thins)


def _frames_in_heat(
    animation: FinishedAnimation, ramp: Bytes, context: BuildContext
) -> tuple[list[RenderedFrame], HeatError]:
    """Return the frames of an animation with sprites of heat, and how well it holds their
    colours in full size."""
    frames, errors = [], []
    for frame, error in context.workers.map(lambda f: _frame_in_heat(f, ramp), animation.frames):
        frames.append(frame)
        errors.append(error)
        context.progress.advance()
    shown = animation.tracks[:1] if animation.bakes_flakes else ()
    has_flakes = any(len(rows) for tracks in shown for rows in tracks.frames)
    return frames, HeatError.of(errors, has_flakes=has_flakes)


def _frame_in_heat(frame: RenderedFrame, ramp: Bytes) -> tuple[RenderedFrame, ErrorSums]:
    heats = [heat_of(sprite.image, ramp) for sprite in frame.sprites]
    error = error_sums(frame.sprites[0].image, heats[0], ramp)
    sprites = tuple(
        replace(sprite, image=_in_first_channel(heat))
        for sprite, heat in zip(frame.sprites, heats, strict=True)
    )
    return replace(frame, sprites=sprites), error


def _in_first_channel(heat: Bytes) -> Bytes:
    image = np.zeros((*heat.shape, 4), np.uint8)
    image[..., 0] = heat
    return image


def _with_shared_sprites(name: str, animation: FinishedAnimation) -> FinishedAnimation:
    """Return an animation of which four consecutive frames have the same sprites, with the heat of
    each in a channel of its own."""
    if len({(frame.width, frame.height) for frame in animation.frames}) > 1:
        raise OutputError(
            f"heat4 lays four frames in one cell, but those of {name} differ in size; make them "
            f"one size, or use heat",
            key=("atlas", "pixels"),
        )
    frames = list[RenderedFrame]()
    for first in range(0, len(animation.frames), len(CHANNELS)):
        four = animation.frames[first : first + len(CHANNELS)]
        sprites = tuple(
            _in_channels(sprites) for sprites in zip(*(f.sprites for f in four), strict=True)
        )
        frames += [replace(frame, sprites=sprites) for frame in four]
    return replace(animation, frames=frames, frames_per_place=len(CHANNELS))


def _in_channels(sprites: Sequence[Sprite]) -> Sprite:
    """Return the sprite that has the heat of up to four in its channels."""
    parts = [Rect(s.x, s.y, s.image.shape[1], s.image.shape[0]) for s in sprites]
    whole = bounding_rect(parts)
    visible = [sprite.visible for sprite in sprites if sprite.visible]
    image = np.zeros((whole.height, whole.width, 4), np.uint8)
    for channel, (sprite, part) in enumerate(zip(sprites, parts, strict=True)):
        top, left = part.y - whole.y, part.x - whole.x
        rows, columns = slice(top, top + part.height), slice(left, left + part.width)
        image[rows, columns, channel] = sprite.image[..., 0]
    size = sprites[0].frame_width, sprites[0].frame_height
    return Sprite(image, whole.x, whole.y, *size, bounding_rect(visible) if visible else None)


def _refuse_lost_embers(name: str, animation: FinishedAnimation, error: HeatError) -> None:
    """Refuse baked embers of other colours than the ramp has for their brightness."""
    if animation.bakes_flakes and error.off_ramp > _MOST_OFF_RAMP:
        raise OutputError(
            f"{100 * error.off_ramp:.1f} % of the light of {name} has colours that one ramp cannot "
            f"hold beside the rest ({error.psnr:.1f} dB); if its embers are of "
            f"another colour than the fire, flakes.bake: false lets clients draw them from the "
            f"tracks in their own, or give them the fire's by flakes.colors; otherwise use "
            f"atlas.pixels: color",
            key=("atlas", "pixels"),
        )


def _note(errors: Mapping[str, HeatError], context: BuildContext) -> None:
    """Note the animation whose colours one axis holds worst."""
    name, worst = max(errors.items(), key=lambda item: item[1].rms)
    others = f", the worst of {len(errors)} animations" if len(errors) > 1 else ""
    advice = (
        f"; under {SEEN_BELOW:g} dB this can be seen: atlas.pixels: color keeps all colours"
        if worst.psnr < SEEN_BELOW
        else ""
    )
    context.progress.note(f"heat: {name}{others}: {worst.sentence()}{advice}")
