"""What keys of the effect promise to be seen."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import Pixels, encode_unit
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flakes.emission import SPARK, TICK
from fire_atlas.effect.flakes.flight import FlightField
from fire_atlas.effect.flame.features import difference_of_gaussians, gradient
from fire_atlas.pipeline.animation.analyse import FrameAnalyser
from fire_atlas.pipeline.animation.animate import prepared_texture
from fire_atlas.pipeline.animation.layers import (
    Layers,
    SimulatedClip,
    compose_layers,
    layers_of,
)
from fire_atlas.pipeline.animation.simulate import simulate
from tests.support.clip_motion import FLAME, MOVES, dis_flow
from tests.support.clips import clip_of, open_clip
from tests.support.effect import (
    AGE,
    KIND,
    SIZE,
    STRETCH,
    VX,
    VY,
    A,
    Array,
    EffectRun,
    R,
    X,
    Y,
    context_of,
    pixel_of,
    run_effect,
)
from tests.support.promises.promise import Figure, Promise, Scale, Unit, mean, merged, nested


@dataclass(frozen=True)
class Seen:
    """The effect, run on a clip; the texture of its flakes if the recipe has one."""

    effect: EffectRun
    simulated: SimulatedClip

    @property
    def clip(self) -> Clip:
        return self.effect.clip

    @property
    def frames(self) -> range:
        """Frames of which pixels are measured."""
        return range(6, self.clip.count, 6)

    @property
    def rows(self) -> Array:
        """All rows of all frames of the tracks."""
        return self.effect.rows

    def layers(self, i: int) -> Layers:
        return layers_of(i, self.simulated, self.effect.recipe)

    def finished(self, i: int) -> Pixels:
        """Return frame ``i`` as it goes onto the page, (H, W, 4), linear, premultiplied."""
        if self.effect.recipe.composite.palette == "clip":
            return np.asarray(self.effect.finished(i), np.float32)
        recipe = self.effect.recipe
        return np.asarray(as_light(compose_layers(self.layers(i), recipe, None)), np.float32)

    def flakes(self, i: int) -> Array:
        """Return the light of the flakes of frame ``i``, (H, W, 3)."""
        light = self.layers(i).flakes
        shape = self.clip.height, self.clip.width, 3
        return np.zeros(shape) if light is None else light.rgb().astype(np.float64)

    def analyser(self) -> FrameAnalyser:
        return FrameAnalyser.of(self.clip, self.effect.study, self.effect.recipe)


def _birth_height(seen: Seen) -> float:
    return 100 * (1 - mean(seen.effect.births[:, 1]) / seen.clip.height)


def _edge_at_births(seen: Seen) -> float:
    """Return the mean ‖∇f‖ where, and when, flakes are born."""
    clip, spawns = seen.clip, seen.effect.analysis.spawns
    frame = np.floor(spawns.tick * TICK * clip.fps + 1e-6).astype(int)
    found = []
    for i in range(clip.count):
        bright = clip.brightness(i)
        edges = np.hypot(*gradient(difference_of_gaussians(bright, (1.0, 1.6), "unit")))
        row, column = spawns.y[frame == i].astype(int), spawns.x[frame == i].astype(int)
        found += edges[row, column].tolist()
    return mean(found)


def _edge_thickness(seen: Seen) -> float:
    """Return the distance, px, over which the strength of edges is alike: to the side by which
    half of its autocorrelation is lost."""
    features, found = seen.effect.recipe.features, []
    for i in seen.frames:
        edges = np.hypot(
            *gradient(
                difference_of_gaussians(seen.clip.brightness(i), features.sigma, features.kernel)
            )
        )
        edges = edges - edges.mean()
        alike = [float((edges[:, d:] * edges[:, : edges.shape[1] - d]).mean()) for d in range(30)]
        found.append(np.interp(-0.5 * alike[0], [-each for each in alike], np.arange(30)))
    return 2 * mean(found)


def _outward(seen: Seen) -> float:
    shares = []
    for i in seen.frames:
        bright = seen.clip.brightness(i)
        features = seen.effect.recipe.features
        gx, gy = gradient(difference_of_gaussians(bright, features.sigma, features.kernel))
        dy, dx = np.gradient(cv2.GaussianBlur(bright, (0, 0), 2.0))
        strong = np.hypot(gx, gy) > np.quantile(np.hypot(gx, gy), 0.9)
        shares.append((gx * dx + gy * dy < 0)[strong].mean())
    return 100 * mean(shares)


def _upward_vectors(seen: Seen) -> float:
    analyser, found = seen.analyser(), []
    for i in seen.frames:
        features = analyser.features(i)
        there = features.strength > 0
        found.append(np.degrees(np.arctan2(-features.y[there], np.abs(features.x[there]))))
    return mean(np.concatenate(found))


def _flow_correlation(seen: Seen) -> float:
    """Return how well embers in the flame move as the clip does, in the same pixels, %: the mean of
    the correlations sideways and upwards."""
    clip, one, other = seen.clip, [], []
    for i in range(0, clip.count - 1, 2):
        rows = seen.effect.tracks.frames[i]
        rows = rows[rows[:, KIND] != SPARK]
        flow, (row, column) = dis_flow(clip, i) * clip.fps, pixel_of(rows, clip)
        moves = np.hypot(*flow[row, column].T) > MOVES * clip.fps
        there = moves & (clip.brightness(i)[row, column] > FLAME)
        one.append(rows[there][:, [VX, VY]])
        other.append(flow[row, column][there])
    moved, flow = np.concatenate(one), np.concatenate(other)
    return 100 * mean([np.corrcoef(moved[:, k], flow[:, k])[0, 1] for k in (0, 1)])


def _rise(seen: Seen) -> float:
    ways = [flight[0, Y] - flight[-1, Y] for flight in seen.effect.flights(3)]
    return 100 * mean(ways) / seen.clip.height


def _drift(seen: Seen) -> float:
    ways = [flight[-1, X] - flight[0, X] for flight in seen.effect.flights(3)]
    return 100 * mean(ways) / seen.clip.height


def _above(seen: Seen) -> Array:
    """Return the rows above the flame: those over which no flame burns below 70 % of its height."""
    top, bottom = seen.effect.study.box.top, seen.effect.study.box.bottom
    rows = seen.rows
    return rows[rows[:, Y] < top + 0.3 * (bottom - top)]


def _rising_speed(seen: Seen) -> float:
    return -100 * mean(_above(seen)[:, VY]) / seen.clip.height


def _speed(seen: Seen) -> float:
    return 100 * mean(np.hypot(seen.rows[:, VX], seen.rows[:, VY])) / seen.clip.height


def _unlike_neighbours(seen: Seen) -> float:
    """Return how unlike the velocities of the flakes of a frame are to the side, % of height/s."""
    return 100 * float(np.std(_above(seen)[:, VX])) / seen.clip.height


def _beside_the_field(seen: Seen) -> float:
    """Return the speed of flakes relative to the field where they are, % of height/s."""
    return _relative_speed(seen, lambda lit: np.ones(len(lit), bool))


def _in_flame_beside_the_field(seen: Seen) -> float:
    """The same of flakes in the flame, % of height/s."""
    return _relative_speed(seen, lambda lit: lit > 0.7)


def _relative_speed(seen: Seen, counts: Callable[[Array], Any]) -> float:
    """Return the median speed, % of height/s, relative to the field, of flakes where the brightness
    of the flame, 0..1, counts."""
    air, found = FlightField(seen.effect.analysis.field), []
    for i, rows in enumerate(seen.effect.tracks.frames):
        if len(rows):
            x, y = np.ascontiguousarray(rows[:, X]), np.ascontiguousarray(rows[:, Y])
            u, v, _, lit = air.at_time(i / seen.clip.fps).at(x, y, np.zeros(len(x)))
            found.append(np.hypot(rows[:, VX] - u, rows[:, VY] - v)[counts(lit)])
    return 100 * float(np.median(np.concatenate(found))) / seen.clip.height


def _turns(seen: Seen) -> float:
    """Return by how much the way of a flake turns from frame to frame, degrees."""
    found = []
    for flight in seen.effect.flights(4):
        way = np.arctan2(flight[:, VY], flight[:, VX])
        found.append(np.abs(np.degrees(np.angle(np.exp(1j * np.diff(way))))))
    return float(np.mean(np.concatenate(found)))


def _field_beside(seen: Seen) -> float:
    """Return the speed of the air beside the flame, % of height/s."""
    flow = seen.effect.analysis.field
    beside = flow.brightness < 20
    beside[:, : int(flow.u.shape[1] * 0.35)] = False  # its plume is above
    return 100 * float(np.hypot(flow.u, flow.v)[beside].mean()) / seen.clip.height


def _divergence(seen: Seen) -> float:
    flow = seen.effect.analysis.field
    across, down = np.gradient(flow.u, axis=2), np.gradient(flow.v, axis=1)
    return float(np.sqrt(np.mean(np.square(across + down)[:, 1:-1, 1:-1]))) / flow.cell


def _steps_in_space(seen: Seen) -> float:
    """Return how much the field changes over a fiftieth of the frame, % of its speed."""
    flow = seen.effect.analysis.field
    shape = (seen.clip.width, seen.clip.height)
    found = []
    for u, v in zip(flow.u[::6], flow.v[::6], strict=True):
        fine = [cv2.resize(plane, shape) for plane in (u, v)]
        step = max(1, seen.clip.height // 50)
        du, dv = (plane[step:] - plane[:-step] for plane in fine)
        found.append(float(np.hypot(du, dv).mean() / np.hypot(*fine).mean()))
    return 100 * mean(found)


def _births(seen: Seen) -> float:
    return len(seen.effect.births) * seen.clip.fps / (seen.clip.count * seen.effect.tracks.rounds)


def _sparks(seen: Seen) -> float:
    return 100 * mean(seen.effect.analysis.spawns.kind == SPARK)


def _bursts(seen: Seen) -> float:
    """Return how many places throw sparks, a second."""
    spawns = seen.effect.analysis.spawns
    thrown = spawns.kind == SPARK
    places = np.unique(np.stack([spawns.x, spawns.y])[:, thrown], axis=1)
    return float(places.shape[1] * seen.clip.fps / seen.clip.count)


def _seconds_alive(seen: Seen) -> float:
    return mean([flight[-1, AGE] for flight in seen.effect.flights()])


def _alive(seen: Seen) -> float:
    return mean([len(rows) for rows in seen.effect.tracks.frames])


def _most_alive(seen: Seen) -> float:
    return float(max(len(rows) for rows in seen.effect.tracks.frames))


def _width(seen: Seen) -> float:
    return float(np.median(seen.rows[:, SIZE]))


def _streak(seen: Seen) -> float:
    """Return how much longer than wide the faster half of the flakes is drawn, px."""
    rows = seen.rows
    extra = rows[:, SIZE] * (rows[:, STRETCH] - 1)
    speed = np.hypot(rows[:, VX], rows[:, VY])
    return float(np.mean(extra[speed >= np.median(speed)])) if len(rows) else 0.0


def _light(seen: Seen) -> float:
    """Return the light that the frames have more than without flakes, a thousandth of a white
    frame, as shown on black."""
    found = []
    for i in seen.frames:
        bare = as_light(seen.layers(i).flame)
        found.append((encode_unit(seen.finished(i)[..., :3]) - encode_unit(bare[..., :3])).mean())
    return 1000 * mean(found)


def _flake_light(seen: Seen) -> float:
    """Return the median light of a flake at its brightest."""
    return float(
        np.median([(flight[:, R] * flight[:, A]).max() for flight in seen.effect.flights(4)])
    )


def _light_spread(seen: Seen) -> float:
    """Return how unlike the light of flakes is at its brightest: the mean factor between two."""
    peaks = [
        float((f[:, R] * f[:, A]).max()) for f in seen.effect.flights(6) if f[0, KIND] != SPARK
    ]
    return float(np.exp(np.std(np.log(np.maximum(peaks, 1e-6)))))


def _light_at_border(seen: Seen) -> float:
    """Return the flakes' light a px² within 3 % of the upper border, relative to that within 30 %
    of it, %."""
    rows, height = seen.rows, seen.clip.height
    light = rows[:, R] * rows[:, A]
    near = (rows[:, Y] >= 0) & (rows[:, Y] < 0.03 * height)
    further = (rows[:, Y] >= 0) & (rows[:, Y] < 0.3 * height)
    return 100 * 10 * float(light[near].sum() / max(light[further].sum(), 1e-9))


def _green(seen: Seen) -> float:
    """Return the green of the flakes' light, % of all of it."""
    total = np.sum([seen.flakes(i).sum(axis=(0, 1)) for i in seen.frames], axis=0)
    return 100 * float(total[1] / max(total.sum(), 1e-9))


def _blue(seen: Seen) -> float:
    total = np.sum([seen.flakes(i).sum(axis=(0, 1)) for i in seen.frames], axis=0)
    return 100 * float(total[2] / max(total.sum(), 1e-9))


def _lit(seen: Seen) -> float:
    """Return the part of the frame in which flakes give light that can be seen, %."""
    return 100 * mean([(seen.flakes(i).max(axis=2) > 0.001).mean() for i in seen.frames])


def _hard(seen: Seen) -> float:
    """Return the light in pixels with at least two thirds of that of the brightest pixel around
    them, %."""
    found = []
    for i in seen.frames:
        light = seen.flakes(i).max(axis=2).astype(np.float32)
        around = cv2.dilate(light, np.ones((5, 5), np.uint8))
        if light.sum() > 0:
            found.append(float(light[light > around * 0.66].sum() / light.sum()))
    return 100 * mean(found)


def _opaque(seen: Seen) -> float:
    """Return the coverage of pixels that flakes touch where the flame is not, %."""
    found: list[float] = []
    for i in seen.frames:
        alpha = seen.finished(i)[..., 3]
        bare = as_light(seen.layers(i).flame)[..., 3]
        touched = (bare < 0.02) & (alpha > 0.05)
        found += alpha[touched].tolist()
    return 100 * mean(found)


def _over_flame(seen: Seen) -> float:
    """Return by how much flakes brighten the flame where it is brighter than half, thousandths."""
    found = []
    for i in seen.frames:
        bare = as_light(seen.layers(i).flame)[..., :3]
        bright = bare.max(axis=2) > 0.5
        found.append((encode_unit(seen.finished(i)[..., :3]) - encode_unit(bare))[bright].mean())
    return 1000 * mean(found)


def _sharpness(seen: Seen) -> float:
    """Return the mean slope of the upper half of the flame's brightness as shown, 1/px, of 255."""
    top, bottom = seen.effect.study.box.top, seen.effect.study.box.bottom
    found = []
    for i in seen.frames:
        shown = encode_unit(as_light(seen.layers(i).flame)[..., :3]).max(axis=2)
        upper = shown[int(top) : int((top + bottom) / 2)]
        found.append(255 * np.hypot(*np.gradient(upper)).mean())
    return mean(found)


def _later_drift(seen: Seen) -> float:
    """Return how much faster to the right flakes fly in the second half, % of height/s."""
    frames = seen.effect.tracks.frames
    half = len(frames) // 2
    early, late = (np.concatenate(each)[:, VX] for each in (frames[:half], frames[half:]))
    return 100 * (mean(late) - mean(early)) / seen.clip.height


def _sideways(seen: Seen) -> Array:
    """Return the mean velocity to the right of the air beside the fire in each frame, heights/s."""
    flow = seen.effect.analysis.field
    quiet = flow.u[:, :, [0, 1, -2, -1]]
    return np.asarray(quiet.mean(axis=(1, 2)) / seen.clip.height, float)


def _swing(seen: Seen) -> float:
    return 100 * float(np.std(_sideways(seen)))


def _swings(seen: Seen) -> float:
    """Return how often the wind swings to and fro, a second."""
    sideways = _sideways(seen)
    smooth = np.convolve(sideways - sideways.mean(), np.ones(3) / 3, "valid")
    strength = np.abs(np.fft.rfft(smooth, 8 * len(smooth)))
    return float(np.fft.rfftfreq(8 * len(smooth), 1 / seen.clip.fps)[np.argmax(strength)])


def _rounds(seen: Seen) -> float:
    return float(seen.effect.tracks.rounds)


BIRTH_HEIGHT = Figure("mean height at which flakes are born", Unit.HEIGHT, _birth_height)
EDGE_AT_BIRTHS = Figure("strength of edges where flakes are born", Unit.NUMBER, _edge_at_births)
THICKNESS = Figure("thickness of edges", Unit.PX, _edge_thickness)
OUTWARD = Figure("strong vectors that lead out of the flame", Unit.SHARE, _outward)
UPWARD = Figure("mean angle of Fv* above the horizontal", Unit.DEGREES, _upward_vectors)
LIKE_FLOW = Figure("correlation of flakes with the clip's flow", Unit.SHARE, _flow_correlation)
RISE = Figure("mean rise of a flake", Unit.HEIGHT, _rise)
DRIFT = Figure("mean way of a flake to the right", Unit.HEIGHT, _drift)
RISING_SPEED = Figure("rising speed above the flame, a second", Unit.HEIGHT, _rising_speed)
SPEED = Figure("mean speed of flakes, a second", Unit.HEIGHT, _speed)
UNLIKE = Figure(
    "spread of sideways speeds above the flame, a second", Unit.HEIGHT, _unlike_neighbours
)
IN_FLAME = Figure(
    "speed beside the field's, in the flame, a second", Unit.HEIGHT, _in_flame_beside_the_field
)
BESIDE_FIELD = Figure(
    "speed of flakes beside the field's, a second", Unit.HEIGHT, _beside_the_field
)
TURNS = Figure("turn of a flake from frame to frame", Unit.DEGREES, _turns)
FIELD_BESIDE = Figure("speed of the air beside the flame, a second", Unit.HEIGHT, _field_beside)
DIVERGENCE = Figure("divergence of the field (rms), 1/s", Unit.NUMBER, _divergence)
STEPS = Figure(
    "change of the field over 2 % of the frame, of its speed", Unit.SHARE, _steps_in_space
)
BIRTHS = Figure("flakes born a second", Unit.NUMBER, _births)
SPARKS = Figure("share of sparks", Unit.SHARE, _sparks)
BURSTS = Figure("places that throw sparks, a second", Unit.NUMBER, _bursts)
SECONDS = Figure("seconds for which a flake is seen", Unit.NUMBER, _seconds_alive)
ALIVE = Figure("flakes alive on average", Unit.NUMBER, _alive)
MOST_ALIVE = Figure("flakes alive at most", Unit.NUMBER, _most_alive)
WIDTH = Figure("median width as drawn", Unit.PX, _width)
STREAK = Figure("length of streaks beyond their width", Unit.PX, _streak)
LIGHT = Figure("light that flakes add to the frame, thousandths", Unit.NUMBER, _light)
FLAKE_LIGHT = Figure("median light of a flake at its brightest", Unit.NUMBER, _flake_light)
LIGHT_SPREAD = Figure("factor between the light of two flakes", Unit.NUMBER, _light_spread)
AT_BORDER = Figure(
    "light near the upper border, relative to further in", Unit.SHARE, _light_at_border
)
GREEN = Figure("green in the light of flakes", Unit.SHARE, _green)
BLUE = Figure("blue in the light of flakes", Unit.SHARE, _blue)
LIT = Figure("part of the frame that flakes light", Unit.NUMBER, _lit)
HARD = Figure("light in pixels as bright as the flake's middle", Unit.SHARE, _hard)
OPAQUE = Figure("coverage where flakes are", Unit.SHARE, _opaque)
OVER_FLAME = Figure("brightening of the bright flame, thousandths", Unit.NUMBER, _over_flame)
SHARPNESS = Figure("slope of the upper flame's brightness", Unit.NUMBER, _sharpness)
LATER_DRIFT = Figure("change of the sideways speed over time", Unit.HEIGHT, _later_drift)
SWING = Figure("swing of the wind (rms), a second", Unit.HEIGHT, _swing)
SWINGS = Figure("swings of the wind, a second", Unit.NUMBER, _swings)
ROUNDS = Figure("rounds in the tracks", Unit.NUMBER, _rounds)

ONCE = {"timeline": {"loop": "none"}}
FEATURES = {"buoyancy": {"motion": "features"}}
AS_PAPER = {"features": {"preset": "paper"}}
MANY = {"flakes": {"rate": 150, "bursts": 0}}
EVEN = {"buoyancy": {"turbulence": 0}, "flakes": {"rate": 150, "bursts": 0, "own_motion": 0}}
BLURRED = {"motion_blur": {"flame": True}}

PROMISES = (
    Promise(
        "features.preset", "flakes differ in neither brightness nor focus",
        LIGHT_SPREAD, "auto", "paper", rises=False, needs=MANY,
    ),
    Promise(
        "features.kernel", "nearly all vectors point out of the flame", OUTWARD, "unit", "printed",
    ),
    Promise(
        "features.sigma", "Larger values give thicker edges", THICKNESS, [0.7, 1.1], [3.0, 4.8],
        clip="cartoon",
    ),
    Promise(
        "features.epsilon", "Gradients below this, on a scale of 0..255, are ignored",
        EDGE_AT_BIRTHS, 5.0, 120.0, needs=MANY,
    ),
    Promise(
        "features.n", "larger values favour the top of the fire over its base",
        BIRTH_HEIGHT, 0.0, 5.0, needs=MANY,
    ),
    Promise(
        "features.kappa_over", "the flame's bounding box, of each fire's own if there are several, "
        "or of the whole image",
        BIRTH_HEIGHT, "flame", "image", rises=False, needs=MANY, clip="campfire, raised",
    ),
    Promise(
        "features.beta", "Weight of the buoyancy direction that is added to each feature vector",
        UPWARD, 0.0, 2.0,
    ),
    Promise(
        "features.clamp", "Edges weaker than this (their feature vectors are shorter) are ignored",
        BIRTHS, 0.0, 30.0, rises=False, needs=MANY,
    ),
    Promise(
        "buoyancy.motion", "the dense optical ``flow`` of the clip, or only its ``features``",
        LIKE_FLOW, "features", "flow", needs=EVEN,
    ),
    Promise("buoyancy.cell", "Side of a grid cell", STEPS, 2, 20, rises=False),
    Promise(
        "buoyancy.coupling", "Rate at which the field adopts the flow inside the flame",
        LIKE_FLOW, 2.0, 250.0, needs=EVEN, clip="torch",
    ),
    Promise(
        "buoyancy.feature_force", "Push by flame edges with ``motion: features``",
        SPEED, 10.0, 200.0, needs={**EVEN, "buoyancy": {"motion": "features", "lift": 0}},
    ),
    Promise("buoyancy.lift", "Upward acceleration", RISING_SPEED, 0.5, 3.0),
    Promise(
        "buoyancy.gravity", "Downward acceleration of field and flakes",
        RISING_SPEED, 0.0, 1.0, rises=False,
    ),
    Promise(
        "buoyancy.drag", "The plume rises at lift / drag", RISING_SPEED, 1.0, 6.0, rises=False,
    ),
    Promise(
        "buoyancy.viscosity", "How fast motion spreads to its surroundings",
        FIELD_BESIDE, 0.0001, 0.01, needs={"buoyancy": {"turbulence": 0}},
    ),
    Promise(
        "buoyancy.turbulence", "Speed (rms) of the turbulence (curl noise) above the flame",
        UNLIKE, 0.0, 0.5, needs=MANY,
    ),
    Promise(
        "buoyancy.projection", "Make the field divergence-free in every step",
        DIVERGENCE, False, True, rises=False,
    ),
    Promise(
        "flakes.class", "a ``candle`` next to none; ``campfire``, ``torch``, ``wall`` and "
        "``explosion`` shed embers",
        BIRTHS, "candle", "campfire",
    ),
    Promise(
        "flakes.style", "a few large dots with smooth edges", WIDTH, "film", "cartoon",
        needs={"flakes": {"class": "campfire"}},
    ),
    Promise("flakes.bake", "Draw the flakes into the frames", LIGHT, False, True),
    Promise(
        "flakes.alpha", "Lower values give more flakes", BIRTHS, 20.0, 100.0, rises=False,
        needs={"flakes": {"rate": 60}},
    ),
    Promise("flakes.rate", "Spawn rate, flakes per second", BIRTHS, 20.0, 80.0),
    Promise(
        "flakes.bursts", "Bursts per second", BURSTS, 1.0, 8.0,
        needs={"flakes": {"rate": 400}, "timeline": {"frames": 192}},
    ),
    Promise("flakes.sparks", "Share of the flakes that are sparks", SPARKS, 0.0, 0.8, needs=MANY),
    Promise("flakes.life", "lifetime of a flake", SECONDS, [0.3, 0.6], [1.5, 2.5]),
    Promise("flakes.size", "width of a flake", WIDTH, [0.003, 0.01], [0.03, 0.08]),
    Promise(
        "flakes.rounds", "the tracks are this many times as long as the animation",
        ROUNDS, 1, 3, needs={"flakes": {"bake": False}},
    ),
    Promise(
        "flakes.stretch", "Lengthens each flake along its motion", STREAK, 0.0, 3.0,
    ),
    Promise(
        "flakes.scatter", "1 no scattering, near 0 erratic", TURNS, 0.9, 1.0, rises=False,
        needs=EVEN,
    ),
    Promise(
        "flakes.own_motion", "How far each ember moves in its own way beside the field",
        BESIDE_FIELD, 0.0, 2.0, needs=MANY,
    ),
    Promise(
        "flakes.lag", "time, s, in which a flake of medium size adopts the field's velocity",
        IN_FLAME, 0.0, 0.2, needs=MANY,
    ),
    Promise(
        "flakes.colors", "Or colours from slow to fast flakes", GREEN, ["#ff2000"], ["#20ff00"],
    ),
    Promise("flakes.intensity", "Multiplier of the flakes' light", FLAKE_LIGHT, 0.3, 3.0),
    Promise("flakes.edge", "``fade`` out near its border", AT_BORDER, "fade", "crop", needs=MANY),
    Promise("flakes.glow", "Light of a wide, soft glow around each soft flake", LIT, 0.0, 1.0),
    Promise("flakes.sprite", "``pixel``: hard squares of whole pixels", HARD, "soft", "pixel"),
    Promise(
        "flakes.tint", "``none``: as painted", BLUE, "heat", "none", texture=True,
    ),
    Promise(
        "flakes.max", "Maximum number of flakes alive at once", MOST_ALIVE, 5, 20, needs=MANY,
    ),
    Promise(
        "motion_blur.shutter", "Time for which the shutter is open", STREAK, 0.1, 2.0, needs=MANY,
    ),
    Promise(
        "motion_blur.flame", "Blur the flame layer too", SHARPNESS, False, True, rises=False,
    ),
    Promise(
        "motion_blur.exaggeration", "Length of the flame's blur at its top", SHARPNESS, 1.0, 16.0,
        rises=False, needs=BLURRED,
    ),
    Promise(
        "composite.blend", "``add`` the light, ``screen`` it (never above 1), or draw flakes "
        "``over`` the flame",
        OVER_FLAME, "over", "add",
        needs={"flakes": {"rate": 3000, "colors": ["#ff4000"]}},
    ),
    Promise("composite.intensity", "Multiplier of the flakes' light", FLAKE_LIGHT, 0.3, 3.0),
    Promise(
        "composite.palette",
        "flakes are opaque, each in the nearest colour that occurs in the clip",
        OPAQUE, "none", "clip",
    ),
    Promise("wind.level", "Strength of a steady wind", DRIFT, 0.0, 3.0, needs=MANY),
    Promise(
        "wind.direction", "Direction a steady wind or gusts blow towards",
        DRIFT, "left", "right", needs={**MANY, "wind": {"level": 2}},
    ),
    Promise(
        "wind.keyframes", "Wind that changes over time", LATER_DRIFT,
        [{"t": 0, "level": 0}], [{"t": 0, "level": 0}, {"t": 1, "level": 4}], needs=ONCE,
    ),
    Promise("wind.gusts.mean", "Mean strength", DRIFT, 1.0, 4.0, needs=MANY),
    Promise(
        "wind.gusts.strength", "how far it rises above and falls below the mean", SWING, 0.0, 2.0,
        needs={"wind": {"gusts": {"mean": 2}}},
    ),
    Promise(
        "wind.gusts.period", "Time from gust to gust", SWINGS, 0.5, 2.0, rises=False,
        needs={"wind": {"gusts": {"mean": 2, "strength": 2}}},
    ),
)  # fmt: skip

WITHOUT = {
    "flakes.texture": "is looked at in tests of textures: its axis, its head, its light",
    "composite.ramp": "gives colours, which tests of ramps hold to those of the ramp",
    "motion_blur.samples": "is how finely a long path is sampled, which is not to be seen",
    "wind.levels": "are of generated fire: see below",
    "flakes.variants": "is how many sets of flakes there are, each in tracks of its own",
}
"""Keys of the effect that promise nothing to be seen on a clip, and why."""


def _blue_square() -> Pixels:
    cell = np.zeros((24, 24, 4), np.float32)
    cell[4:20, 4:20] = 0.05, 0.1, 1.0, 1.0
    return cell


@lru_cache(maxsize=4)
def raised(height: int) -> Clip:
    """Return the campfire in the upper half of a frame of twice its height."""
    clip = open_clip("campfire", height)
    below = np.zeros((clip.height, clip.width, 4), np.float32)
    return clip_of([np.vstack([clip.read(i), below]) for i in range(clip.count)], clip.fps)


def clip_for(promise: Promise, height: int) -> Clip:
    """Return the clip on which a promise is measured."""
    return raised(height) if promise.clip == "campfire, raised" else open_clip(promise.clip, height)


def run(promise: Promise, value: Any, seed: int, scale: Scale) -> Seen:
    """Run the effect with the promise's key at ``value``, or left out if that is None."""
    keys = merged(promise.needs, {"seed": seed})
    if value is not None:
        keys = merged(keys, nested(promise.key, value))
    if promise.texture:
        keys = merged({"flakes": {"texture": "square.png"}}, keys)
    effect = run_effect(clip_for(promise, scale.height), keys)
    if not promise.texture:
        return Seen(effect, effect.simulated)
    with Workers(1) as workers:
        context = context_of(workers)
        prepared = prepared_texture(effect.recipe, effect.clip, [_blue_square()], context)
        assert prepared is not None
        tracks = simulate(
            effect.clip, effect.study, effect.analysis, effect.recipe, context, prepared.shape
        )
    simulated = SimulatedClip(effect.clip, effect.study, effect.analysis, (tracks,), prepared.shape)
    return Seen(effect, simulated)
