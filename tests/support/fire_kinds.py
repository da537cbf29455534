"""Twelve kinds of fire, and things that are taken for fire, painted here: small and fast to make.

Each is a clip of light whose kind, colours and motion are known, because they were chosen.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, premultiply, srgb_to_linear
from tests.support.clips import clip_of

Plane = NDArray[np.float64]

FPS = 24.0
HEIGHT = 128
FRAMES = 32

FIRE = ((0, 0, 0), (90, 12, 2), (220, 70, 8), (255, 150, 30), (255, 225, 130), (255, 250, 225))
PINK = ((0, 0, 0), (90, 5, 60), (225, 40, 150), (255, 110, 200), (255, 200, 240), (255, 240, 255))
BLUE = ((0, 0, 0), (5, 20, 90), (20, 90, 225), (60, 170, 255), (170, 230, 255), (240, 250, 255))
GREY = ((0, 0, 0), (60, 60, 60), (130, 130, 130), (190, 190, 190), (235, 235, 235), (255,) * 3)
"""Ramps of sRGB colours, cold to hot, in equal steps."""


@dataclass(frozen=True, slots=True)
class _Canvas:
    """Pixel centres in heights, x from the middle, y up from the lower edge, both (h, w)."""

    x: Plane
    y: Plane

    @classmethod
    def of(cls, width: int = HEIGHT, height: int = HEIGHT) -> "_Canvas":
        row, column = np.mgrid[:height, :width] + 0.5
        return cls((column - width / 2) / height, 1 - row / height)


class _Noise:
    """Smooth noise of mean 0.5 that repeats, to be sampled anywhere."""

    def __init__(self, seed: int, side: int = 64, roughness: float = 2.0) -> None:
        chance = np.random.default_rng(seed)
        total = np.zeros((side, side), np.float32)
        for octave, cells in enumerate((8, 16, 32)):
            coarse = chance.random((cells, cells), np.float32)
            tiled = cv2.resize(
                np.tile(coarse, (3, 3)), (3 * side,) * 2, interpolation=cv2.INTER_CUBIC
            )
            total += (tiled[side : 2 * side, side : 2 * side] - 0.5) / roughness**octave
        self._grid = np.clip(0.5 + total, 0, 1)

    def at(self, x: Plane, y: Plane, scale: float) -> Plane:
        """Sample it at places in heights; 8 / ``scale`` blobs a height."""
        side = len(self._grid)
        u, v = (np.mod(each / scale * side, side).astype(np.float32) for each in (x, y))
        wrapped = np.pad(self._grid, ((0, 1), (0, 1)), mode="wrap")
        return cv2.remap(wrapped, u, v, cv2.INTER_LINEAR).astype(np.float64)


def _coloured(heat: Plane, ramp: Sequence[tuple[int, ...]]) -> Pixels:
    """Transparent pixels of ``heat``, 0..1: coverage grows with it, colours follow the ramp."""
    stops = np.linspace(0, 1, len(ramp))
    heat = np.clip(heat, 0, 1)
    shown = [np.interp(heat, stops, [colour[c] for colour in ramp]) for c in range(3)]
    alpha = np.clip(heat * 2.5, 0, 1)
    return premultiply(srgb_to_linear(np.stack(shown, axis=-1) / 255), alpha.astype(np.float32))


def _over(front: Pixels, scene: Plane) -> Pixels:
    """Opaque pixels: light in ``front`` of a ``scene`` of sRGB colours (h, w, 3), 0..255."""
    behind = srgb_to_linear(np.clip(scene, 0, 255) / 255)
    light = front[..., :3] + behind * (1 - front[..., 3:])
    return np.dstack([light, np.ones(light.shape[:2], np.float32)]).astype(np.float32)


def _rising(
    canvas: _Canvas, t: float, noise: _Noise, size: tuple[float, float], speed: float
) -> Plane:
    """Heat of a flame of a width and height, in heights, whose gas rises at ``speed`` heights/s."""
    width, height = size
    up = (canvas.y - 0.06) / height
    sway = 0.12 * width * np.sin(2 * np.pi * (1.3 * t - up)) * np.clip(up, 0, 1)
    across = np.abs(canvas.x + sway) / (width / 2)
    body = 1.25 - across**2 / np.clip(1.1 - up, 0.05, 1) - 1.1 * np.clip(up, 0, 2)
    ragged = noise.at(canvas.x, canvas.y - speed * t, 0.8) - 0.5
    heat = body + 1.6 * ragged * np.clip(up + 0.25, 0, 1)
    return np.where(up > -0.05, np.clip(heat, 0, 1), 0.0)


def _clip(paint: Callable[[float], Pixels], matte: str, *, loop: bool = False) -> Clip:
    frames = [paint(i / FPS) for i in range(FRAMES)]
    return replace(clip_of(frames, FPS, matte), loop=loop)


def streaming(
    velocity: tuple[float, float], ramp: Sequence[tuple[int, ...]] = FIRE, *, flies: bool = False
) -> Clip:
    """Fire whose gas streams at ``velocity``, heights/s, y up; or a ball that ``flies`` with it."""
    canvas, noise = _Canvas.of(), _Noise(3)
    speed = np.hypot(*velocity)
    along = np.array(velocity) / speed

    def paint(t: float) -> Pixels:
        moved = np.array(velocity) * (t - FRAMES / FPS / 2) if flies else np.zeros(2)
        x, y = canvas.x - moved[0], canvas.y - 0.5 - moved[1]
        # A ball's tail lies behind it, a jet's in front of its foot.
        far = (x * along[0] + y * along[1]) * (-1 if flies else 1) + (0.0 if flies else 0.3)
        across = x * along[1] - y * along[0]
        length = 0.35 if flies else 0.65
        body = 1.15 - (across / (0.16 * np.clip(1.05 - far / length, 0.1, 1))) ** 2
        body -= 1.0 * np.clip(far / length, 0, 3) + 6 * np.clip(-far / 0.2, 0, 9) ** 2
        drift = np.zeros(2) if flies else np.array(velocity) * t
        ragged = noise.at(x - drift[0], y - drift[1], 0.6) - 0.5
        return _coloured(body + 1.3 * ragged * np.clip(far / length + 0.3, 0, 1), ramp)

    return _clip(paint, "alpha")


def gas_ring() -> Clip:
    """A burner of a stove: a ring of small blue cones that hardly move."""
    canvas = _Canvas.of()

    def paint(t: float) -> Pixels:
        heat = np.zeros_like(canvas.x)
        for k in range(20):
            angle = 2 * np.pi * k / 20
            x, y = 0.33 * np.cos(angle), 0.3 + 0.1 * np.sin(angle)
            tall = 0.16 * (1 + 0.06 * np.sin(2 * np.pi * 3 * t + 2.4 * k))
            up = (canvas.y - y) / tall
            cone = 1 - (np.abs(canvas.x - x) / (0.03 * np.clip(1 - up, 0.05, 1))) ** 2
            heat = np.maximum(
                heat, np.where(up > 0, 0.55 * np.clip(cone, 0, 1) * (1 - 0.4 * up), 0)
            )
        return _coloured(heat, BLUE)

    return _clip(paint, "alpha")


def candle_in_a_bright_room() -> Clip:
    """A candle before a sunlit wall with a window: no matte, the flame is a small part of it."""
    canvas = _Canvas.of(192)
    wall = np.stack([205 - 30 * canvas.y, 196 - 32 * canvas.y, 178 - 34 * canvas.y], axis=-1)
    wall[(np.abs(canvas.x + 0.5) < 0.16) & (np.abs(canvas.y - 0.65) < 0.2)] = (244, 248, 252)
    stick = (np.abs(canvas.x) < 0.05) & (canvas.y < 0.3)
    wall[stick] = (226, 214, 196)

    def paint(t: float) -> Pixels:
        lean = 0.014 * np.sin(2 * np.pi * 1.1 * t) + 0.006 * np.sin(2 * np.pi * 2.7 * t)
        tall = 0.15 * (1 + 0.05 * np.sin(2 * np.pi * 1.9 * t + 1))
        up = (canvas.y - 0.31) / tall
        width = 0.032 * np.sqrt(np.clip(up, 0, 1)) * np.sqrt(np.clip(1 - up, 0, 1)) * 2
        across = np.abs(canvas.x - lean * up) / np.maximum(width, 1e-3)
        heat = np.where((up > 0) & (up < 1), np.clip(1.6 - 1.2 * across, 0, 1), 0)
        return _over(_coloured(heat, FIRE[2:]), wall)

    return _clip(paint, "none")


def pixel_torch() -> Clip:
    """Pixel art of six colours in 32 x 48 px, drawn at 10 frames per second."""
    canvas, noise = _Canvas.of(32, 48), _Noise(5)
    ramp = np.array([(96, 16, 24), (190, 38, 20), (238, 110, 20), (252, 190, 50), (255, 244, 170)])

    def paint(t: float) -> Pixels:
        heat = _rising(canvas, t, noise, (0.42, 0.85), 0.9)
        step = np.floor(heat * 5.99).astype(int)
        shown = np.where(step[..., None] > 0, ramp[np.clip(step - 1, 0, 4)], 0)
        shown[(np.abs(canvas.x) < 0.06) & (canvas.y < 0.1)] = (92, 58, 32)
        solid = (shown.sum(axis=-1) > 0).astype(np.float32)
        return premultiply(srgb_to_linear(shown / 255), solid)

    frames = [paint(i / 10) for i in range(8)]
    return clip_of(frames, 10.0, "alpha")


def pink_comet() -> Clip:
    """A magic missile in pink: its head stays, its tail streams to the left."""
    return streaming((-1.1, 0.0), PINK)


def grey_puff() -> Clip:
    """A puff of fire in grey, meant to be tinted: white where it is hot; it plays once."""
    canvas, noise = _Canvas.of(), _Noise(7)

    def paint(t: float) -> Pixels:
        age = t * FPS / FRAMES
        radius = 0.08 + 0.3 * np.sqrt(age)
        far = np.hypot(canvas.x, canvas.y - 0.45 - 0.1 * age)
        ragged = noise.at(canvas.x, canvas.y - 0.3 * t, 0.7) - 0.5
        return _coloured((1.2 - far / radius + ragged) * min(1, 8 * (1 - age)) ** 2, GREY)

    return _clip(paint, "alpha")


def daylight_bonfire() -> Clip:
    """A bonfire by day: blue and white sky, grass, and bright smoke that drifts over it."""
    canvas, noise, smoke = _Canvas.of(192), _Noise(11), _Noise(12)
    clouds = noise.at(canvas.x, canvas.y, 1.7)[..., None] > 0.55
    sky = np.stack([150 + 80 * (1 - canvas.y), 190 + 45 * (1 - canvas.y), 240 + 0 * canvas.x], -1)
    sky = np.where(clouds, 250.0, sky)
    grass = np.stack(
        [86 + 60 * smoke.at(canvas.x, canvas.y, 0.3), 120 + 0 * canvas.x, 60 + 0 * canvas.x], -1
    )
    scene = np.where(canvas.y[..., None] < 0.22, grass, sky)

    def paint(t: float) -> Pixels:
        flame = _rising(canvas, t, noise, (0.42, 0.5), 1.3)
        up = canvas.y - 0.3
        lean = 0.15 * up
        plume = np.exp(-(((canvas.x - lean) / (0.1 + 0.22 * np.clip(up, 0, 1))) ** 2)) * (up > 0)
        thick = np.clip(1.6 * plume * (smoke.at(canvas.x, canvas.y - 0.4 * t, 1.0) - 0.25), 0, 0.85)
        grey = 168 + 70 * smoke.at(canvas.x + 0.4, canvas.y - 0.4 * t, 0.6)
        smoky = scene * (1 - thick[..., None]) + grey[..., None] * thick[..., None]
        return _over(_coloured(flame, FIRE), smoky)

    return _clip(paint, "none")


def flat_vector_fire() -> Clip:
    """A flame of four flat colours with smooth outlines, as drawn with vectors."""
    side, fine = 192, 2
    canvas = _Canvas.of(fine * side, fine * side)
    layers = (
        ((214, 54, 32), 1.0), ((240, 120, 30), 0.74), ((250, 190, 60), 0.5), ((255, 240, 180), 0.26)
    )  # fmt: skip

    def paint(t: float) -> Pixels:
        shown = np.zeros((*canvas.x.shape, 4), np.float32)
        for colour, size in layers:
            tall = 0.8 * size * (1 + 0.05 * np.sin(2 * np.pi * 1.5 * t + 3 * size))
            up = (canvas.y - 0.08) / tall
            sway = 0.05 * np.sin(2 * np.pi * (1.5 * t - 0.8 * up)) * np.clip(up, 0, 1)
            wide = 0.3 * size * np.clip(up, 0, 1) ** 0.4 * np.clip(1 - up, 0, 1) ** 0.7 * 1.6
            inside = (up > 0) & (up < 1) & (np.abs(canvas.x + sway) < wide)
            shown[inside] = [*srgb_to_linear(np.array(colour) / 255), 1.0]
        return np.asarray(cv2.resize(shown, (side, side), interpolation=cv2.INTER_AREA), np.float32)

    return _clip(paint, "alpha", loop=True)


def lava() -> Clip:
    """The surface of lava: bright cracks in a dark crust that drifts slowly; it fills the frame."""
    canvas, noise = _Canvas.of(), _Noise(13)

    def paint(t: float) -> Pixels:
        crust = noise.at(canvas.x - 0.03 * t, canvas.y + 0.02 * t, 0.9)
        cracks = np.exp(-(((crust - 0.5) / 0.07) ** 2))
        glow = noise.at(canvas.x + 0.02 * t, canvas.y, 1.9) * (0.92 + 0.08 * np.sin(4 * t))
        return _over(
            _coloured(np.clip(0.12 + 0.75 * cracks * (0.5 + glow), 0, 1), FIRE),
            np.zeros((*crust.shape, 3)),
        )

    return _clip(paint, "none")


def explosion() -> Clip:
    """A ball of fire that bursts, grows, and turns into dark smoke; it plays once."""
    canvas, noise = _Canvas.of(), _Noise(17)

    def paint(t: float) -> Pixels:
        age = t * FPS / FRAMES
        radius = 0.06 + 0.36 * (1 - np.exp(-6 * age))
        x, y = canvas.x, canvas.y - 0.48
        far = np.hypot(x, y)
        ragged = noise.at(x * 0.2 / radius, y * 0.2 / radius - 0.1 * t, 0.5) - 0.5
        body = np.clip(3 * (1.1 - far / radius + 1.1 * ragged), 0, 1)
        heat = body * np.clip(1.3 - 2.6 * age + 0.8 * ragged, 0, 1)
        fire = _coloured(heat, FIRE)
        soot = premultiply(
            np.full((*far.shape, 3), 0.02, np.float32),
            (body * min(1, 3 * age) * (1 - age) * 0.8).astype(np.float32),
        )
        return np.asarray(fire + soot * (1 - fire[..., 3:]), np.float32)

    return _clip(paint, "alpha")


def sparkler() -> Clip:
    """A sparkler: white sparks that fly off a point in all directions, others in every frame."""
    side = 3 * HEIGHT

    def paint(t: float) -> Pixels:
        chance = np.random.default_rng(round(t * FPS) + 100)
        canvas = np.zeros((side, side), np.uint8)
        middle = np.array([side / 2, side * 0.5])
        for angle, near, far in zip(
            chance.uniform(0, 2 * np.pi, 70), chance.random(70), chance.random(70), strict=True
        ):
            way = np.array([np.cos(angle), np.sin(angle)]) * side
            start, end = middle + way * 0.3 * near, middle + way * (0.3 * near + 0.12 * far)
            cv2.line(canvas, tuple(start.astype(int)), tuple(end.astype(int)), 255, 2, cv2.LINE_AA)
        small = cv2.resize(canvas, (HEIGHT, HEIGHT), interpolation=cv2.INTER_AREA) / 255
        grid = _Canvas.of()
        core = np.exp(-((np.hypot(grid.x, grid.y - 0.5) / 0.05) ** 2))
        return _coloured(np.clip(1.4 * small + core, 0, 1), FIRE)

    return _clip(paint, "alpha")


def smoke_without_fire() -> Clip:
    """Grey smoke that rises from an ashtray before a dark wall: there is no flame."""
    canvas, noise = _Canvas.of(), _Noise(19)
    wall = np.stack([46 + 20 * canvas.y, 46 + 22 * canvas.y, 52 + 24 * canvas.y], axis=-1)

    def paint(t: float) -> Pixels:
        up = canvas.y - 0.1
        bend = 0.06 * np.sin(2 * np.pi * (0.5 * t - 1.2 * up)) * np.clip(up, 0, 1)
        plume = np.exp(-(((canvas.x + bend) / (0.05 + 0.2 * np.clip(up, 0, 1))) ** 2)) * (up > 0)
        thick = np.clip(2 * plume * (noise.at(canvas.x, canvas.y - 0.5 * t, 0.8) - 0.2), 0, 0.9)
        smoke = premultiply(
            np.full((*thick.shape, 3), srgb_to_linear(np.array(188 / 255)), np.float32),
            thick.astype(np.float32),
        )
        return _over(smoke, wall)

    return _clip(paint, "none")


def blue_soul_fire() -> Clip:
    """Animated fire in blue, as a game's: it rises and tears like any other."""
    canvas, noise = _Canvas.of(), _Noise(23)
    return _clip(lambda t: _coloured(_rising(canvas, t, noise, (0.5, 0.85), 1.2), BLUE), "alpha")


def glossy_flame() -> Clip:
    """A flame as of an icon: soft shades, opaque up to a crisp outline; it sways."""
    side, fine = 128, 3
    canvas = _Canvas.of(fine * side, fine * side)

    def paint(t: float) -> Pixels:
        up = (canvas.y - 0.1) / (0.75 + 0.03 * np.sin(2 * np.pi * 1.5 * t))
        sway = 0.06 * np.sin(2 * np.pi * (1.5 * t - 0.6 * up)) * np.clip(up, 0, 1)
        wide = 0.5 * np.clip(up, 0, 1) ** 0.4 * np.clip(1 - up, 0, 1) ** 0.7
        inside = (up > 0) & (up < 1) & (np.abs(canvas.x + sway) < wide)
        shade = np.clip(0.55 + 0.4 * (1 - up) - 0.8 * np.abs(canvas.x + sway), 0.5, 0.95)
        colour = srgb_to_linear(_coloured(shade, FIRE)[..., :3])
        shown = np.dstack([srgb_to_linear(np.clip(colour, 0, 1) ** 0.5), np.ones_like(up)])
        shown[~inside] = 0
        small = cv2.resize(shown.astype(np.float32), (side, side), interpolation=cv2.INTER_AREA)
        return np.asarray(small, np.float32)

    return _clip(paint, "alpha", loop=True)


def thin_ring() -> Clip:
    """A ring of low flames seen from above, which reaches all edges of the frame."""
    canvas, noise = _Canvas.of(), _Noise(23)

    def paint(t: float) -> Pixels:
        x, y = canvas.x, canvas.y - 0.5
        ragged = noise.at(x + 0.05 * t, y - 0.3 * t, 0.5) - 0.5
        heat = np.exp(-(((np.hypot(x, y) - 0.46) / 0.022) ** 2)) * (1 + 0.9 * ragged)
        return _coloured(np.clip(heat, 0, 1), FIRE)

    return _clip(paint, "alpha")


KINDS: dict[str, Callable[[], Clip]] = {
    "gas ring": gas_ring,
    "candle in a bright room": candle_in_a_bright_room,
    "pixel torch": pixel_torch,
    "pink comet": pink_comet,
    "grey puff": grey_puff,
    "daylight bonfire": daylight_bonfire,
    "flat vector fire": flat_vector_fire,
    "lava": lava,
    "explosion": explosion,
    "sparkler": sparkler,
    "smoke without fire": smoke_without_fire,
    "blue soul fire": blue_soul_fire,
    "glossy flame": glossy_flame,
    "thin ring": thin_ring,
}
