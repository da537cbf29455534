"""The C# player, compiled as C# 7.2 against stubs and run by Mono."""

import json
import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.cli import main
from fire_atlas.core.pixels import encode_unit
from fire_atlas.effect.flakes.drawing import draw_pixels
from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks
from fire_atlas.engines.unity.flake_tracks import AnimationFlakes, flake_bytes
from fire_atlas.engines.unity.names import player_name
from fire_atlas.formats.tracks.tracks_json import read_tracks
from tests.engines.unity import mcs
from tests.engines.unity.mcs import CSHARP, STUBS
from tests.engines.unity.products import Fire, exported, some_tracks
from tests.support.embers import SIDE, SINGLE, blended, overlapping, own_frame, shown, tracks_of

X, Y, ALONG_X, ALONG_Y, ACROSS_X, ACROSS_Y = range(6)
"""Columns of what the harness prints; what follows is:"""

LIGHT, SHAPE = slice(6, 9), slice(9, 13)

pytestmark = pytest.mark.usefixtures("mono")


@dataclass(frozen=True, slots=True)
class Player:
    """A compiled player and the bytes it plays."""

    program: Path
    tracks: Path

    def lines(self, how: str, state: str, frames: Sequence[float], *rest: str) -> list[str]:
        stated = ",".join(map(repr, frames))
        # A nursery so small that any allocation in a loop has to be collected.
        env = {**os.environ, "MONO_GC_PARAMS": "nursery-size=256k"}
        done = subprocess.run(
            ["mono", str(self.program), how, str(self.tracks), state, stated, *rest],
            capture_output=True, text=True, check=True, env=env,
        )  # fmt: skip
        return done.stdout.splitlines()

    def flakes(
        self, how: str, state: str, frames: Sequence[float], *rest: str
    ) -> list[NDArray[np.float64]]:
        """(flakes, 13) at each moment."""
        lines = self.lines(how, state, frames, *rest)
        stated = lines[1:] if how == "show" else lines[:-1]
        assert len(stated) == len(frames)
        tables = [np.array(line.split(), float) for line in stated]
        return [table[1:].reshape(int(table[0]), 13) for table in tables]


def compiled(script: Path, namespace: str = "FireAtlas", harness: str = "Harness.cs") -> Path:
    """Compile a player with a ``harness``; warnings are errors."""
    text = (CSHARP / harness).read_text(encoding="utf-8")
    alias = f"using Player = {namespace}.{script.stem};\n\nstatic class"
    sources = {path.name: path.read_text(encoding="utf-8") for path in (script, *STUBS)}
    sources[harness] = text.replace("static class", alias, 1)
    program = script.with_suffix(".exe")
    mcs.compiled(program, sources, *mcs.STRICT)
    return program


def player_of(fire: Fire, folder: Path, namespace: str = "FireAtlas") -> Player:
    files = exported(fire.product(), namespace=namespace)
    script = folder / f"{player_name(fire.name)}.cs"
    tracks = folder / f"{fire.name}.flakes.bytes"
    for path in (script, tracks):
        path.write_bytes(files[path.name])
    return Player(compiled(script, namespace), tracks)


def expected(tracks: Tracks, frame: float, pivot: tuple[float, float]) -> NDArray[np.float64]:
    """What flies at a moment, from the tracks: x right and y up from the pivot."""
    whole = int(frame) % len(tracks.frames)
    rows = tracks.frames[whole]
    column = dict(zip(COLUMNS, rows.T, strict=True))
    passed = frame - int(frame)
    x = column["x"] + column["vx"] / tracks.fps * passed - pivot[0]
    y = column["y"] + column["vy"] / tracks.fps * passed - pivot[1]
    light = np.stack([column[c] * column["a"] for c in "rgb"])
    reach = np.where(light.max(axis=0) * 0.004 > 1e-4, 2.5, 1)
    half, turn = column["size"] / 2 * reach, column["rotation"]
    long = half + column["size"] / 2 * (column["stretch"] - 1)
    return np.column_stack([
        x, -y, long * np.cos(turn), -long * np.sin(turn), -half * np.sin(turn),
        -half * np.cos(turn), *light,
    ])  # fmt: skip


@pytest.mark.parametrize("name", ["fire", "2nd-fire.x", "class", "F_1"])
def test_players_of_any_name_compile(name: str, tmp_path: Path) -> None:
    assert player_of(Fire({name: 3}, name=name), tmp_path).lines("show", name, [0])


@pytest.mark.parametrize("namespace", ["Game.Mesh", "fire_flakes", "_0.Debug.Object"])
def test_a_namespace_hides_nothing_from_the_player(namespace: str, tmp_path: Path) -> None:
    assert player_of(Fire({"fire": 3}), tmp_path, namespace).lines("show", "fire", [0])


def test_two_players_compile_into_one_assembly(tmp_path: Path) -> None:
    scripts = []
    for name in ("fire", "my-fire", "my_fire"):
        script = tmp_path / f"{player_name(name)}.cs"
        script.write_bytes(exported(Fire({name: 2}, name=name).product())[script.name])
        scripts.append(str(script))
    subprocess.run(
        ["mcs", "-langversion:7.2", "-target:library", f"-out:{tmp_path / 'all.dll'}",
         *scripts, str(CSHARP / "Stubs.cs")], check=True, capture_output=True,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("clip", "source"),
    [
        ("cartoon_wesnoth_campfire", {}),
        ("sim_unity_flame02", {"height": 96, "count": 16}),
        ("real_candle_red", {"height": 96, "count": 16}),
    ],
)
def test_flakes_of_real_clips_fly_as_in_the_tracks(
    clips: Path, tmp_path: Path, clip: str, source: dict[str, int]
) -> None:
    recipe = {
        "source": {"path": str(clips / clip / "frames"), "fps": 24, **source},
        "flakes": {"bake": False, "rate": 60}, "exports": ["json", "unity"], "tracks": ["json"],
    }  # fmt: skip
    (tmp_path / "fire.yaml").write_text(json.dumps(recipe))
    assert main(["build", "-q", str(tmp_path / "fire.yaml")]) == 0
    build = tmp_path / "build"
    tracks = read_tracks(build / "fire.flakes.json")
    assert tracks is not None
    player = Player(compiled(build / "fire_flakes.cs"), build / "fire.flakes.bytes")
    count = len(tracks.frames)
    drawn = player.flakes("show", "fire", [float(i) for i in range(count)])
    assert sum(map(len, drawn)) > 100
    pivot = _pivot(build)
    for frame, quads in enumerate(drawn):
        wanted = expected(tracks, frame, pivot)
        assert len(quads) == len(wanted)
        np.testing.assert_allclose(quads[:, :2], wanted[:, :2], atol=0.002)
        # The JSON rounds opacity to five decimals, of light far above 1.
        np.testing.assert_allclose(quads[:, LIGHT], wanted[:, LIGHT], rtol=0.002, atol=5e-3)
        # Whether the faintest halos are drawn may depend on that.
        brightest = wanted[:, LIGHT].max(axis=1)
        sure = np.abs(brightest - 0.025) > 5e-3
        shape = quads[sure, 2:6], wanted[sure, 2:6]
        np.testing.assert_allclose(*shape, rtol=0.002, atol=0.02)


def _pivot(build: Path) -> tuple[float, float]:
    frame = next(iter(json.loads((build / "fire.json").read_text())["frames"].values()))
    return (
        frame["anchor"]["x"] * frame["sourceSize"]["w"],
        frame["anchor"]["y"] * frame["sourceSize"]["h"],
    )


def shapes_of(quad: NDArray[np.float64], side: int) -> NDArray[np.float64]:
    """Return the shape that the shader gets at each pixel of a quad, (pixels, 4), and nan outside.

    The picture is ``side`` px wide and high, with the pivot at (30, 54).
    """
    px, py = np.meshgrid(np.arange(side) + 0.5, np.arange(side) + 0.5)
    dx, dy = px - (quad[X] + 30), (54 - py) - quad[Y]
    area = quad[ALONG_X] * quad[ACROSS_Y] - quad[ALONG_Y] * quad[ACROSS_X]
    u = (dx * quad[ACROSS_Y] - dy * quad[ACROSS_X]) / area
    v = (dy * quad[ALONG_X] - dx * quad[ALONG_Y]) / area
    x, y, half, tail = quad[SHAPE]
    shape = np.stack([u * x, v * y, np.full_like(u, half), np.full_like(u, tail)], axis=-1)
    shape[np.maximum(np.abs(u), np.abs(v)) >= 1] = np.nan
    return shape.reshape(-1, 4)


@dataclass(frozen=True, slots=True)
class Shader:
    """The functions of the flakes' shader, run by Mono."""

    program: Path

    @classmethod
    def compiled(cls, folder: Path) -> "Shader":
        text = exported(Fire({"fire": 1}).product())["fire.flakes.shader"].decode()
        functions = text[text.index("float soft(") : text.index("half4 shade(")]
        around = (CSHARP / "Hlsl.cs").read_text(encoding="utf-8")
        program = folder / "Shader.exe"
        mcs.compiled(program, {"Shader.cs": around.replace("FUNCTIONS", functions)})
        return cls(program)

    def shown(self, quad: NDArray[np.float64], side: int) -> NDArray[np.float64]:
        """Return what the shader shows of a quad, linear (side, side, 3); 0 outside of it."""
        shapes, shown = shapes_of(quad, side), np.zeros((side * side, 3))
        inside = ~np.isnan(shapes[:, 0])
        lines = np.hstack([shapes[inside], np.broadcast_to(quad[LIGHT], (inside.sum(), 3))])
        text = "\n".join(" ".join(map(repr, line)) for line in lines.tolist())
        done = subprocess.run(
            ["mono", str(self.program)], input=text, capture_output=True, text=True, check=True
        )
        shown[inside] = np.array([line.split() for line in done.stdout.splitlines()], float)
        return shown.reshape(side, side, 3)


def quads_of(rows: NDArray[np.float64], folder: Path) -> NDArray[np.float64]:
    """Return the quads that the player makes of embers."""
    player = player_of(Fire({"fire": 9}), folder)
    player.tracks.write_bytes(flake_bytes([AnimationFlakes("fire", (30, 54), tracks_of(rows))]))
    (quads,) = player.flakes("show", "fire", [0])
    return quads


def as_bytes(shown: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convert linear 0..1 to sRGB 0..255."""
    picture: NDArray[np.float64] = encode_unit(shown.astype(np.float32)).astype(float) * 255
    return np.rint(picture)


def test_an_ember_alone_is_shown_as_in_our_frame(tmp_path: Path) -> None:
    shader = Shader.compiled(tmp_path)
    rows = np.array([*SINGLE.values()])
    for row, quad in zip(rows, quads_of(rows, tmp_path), strict=True):
        seen = as_bytes(shader.shown(quad, SIDE))
        assert np.abs(seen - own_frame(row)).max() <= 3
        assert seen.max() > 20


@pytest.mark.parametrize(("space", "most"), [("linear", 1.3), ("gamma", 11.0)])
def test_overlapping_embers_are_close_to_their_sum(space: str, most: float, tmp_path: Path) -> None:
    """Each is screened onto those behind it, in light or in what the screen shows.

    Some of these are much brighter than white: a hard case. In frames of the samples the means are
    below 0.1 and 1.3.
    """
    shader, rows = Shader.compiled(tmp_path), overlapping()
    picture = np.zeros((SIDE, SIDE, 3))
    for quad in quads_of(rows, tmp_path):
        shown = shader.shown(quad, SIDE)
        if space == "gamma":
            shown = as_bytes(shown) / 255
        picture = (
            np.rint((shown + picture * (1 - shown)) * 255) / 255
            if space == "gamma"
            else (shown + picture * (1 - shown))
        )
    seen = picture * 255 if space == "gamma" else as_bytes(picture)
    own = own_frame(rows)
    if space == "gamma":
        screened = blended(rows, lambda ember, behind: ember + behind * (1 - ember))
        assert np.abs(seen - screened).max() <= 3
    lit = own.max(axis=2) > 2
    assert np.abs(seen - own)[lit].mean() < most


def test_hard_flakes_are_squares_on_whole_pixels_for_a_frame(tmp_path: Path) -> None:
    column = dict.fromkeys(COLUMNS, np.zeros(3))
    column |= {
        "x": np.array([10.2, 30.5, 44.9]), "y": np.array([12.6, 40.1, 3.3]),
        "vx": np.array([50.0, -20.0, 0.0]), "size": np.array([1.0, 2.0, 2.0]),
        "stretch": np.ones(3), "rotation": np.array([0.4, -1.5, 0.0]),
        "r": np.array([1.0, 3.0, 0.5]), "g": np.full(3, 0.25), "a": np.array([1.0, 0.5, 1.0]),
    }  # fmt: skip
    frame = np.column_stack([column[name] for name in COLUMNS])
    tracks = replace(some_tracks(2), frames=(frame, frame), hard=True)
    player = player_of(Fire({"fire": 2}), tmp_path)
    player.tracks.write_bytes(flake_bytes([AnimationFlakes("fire", (30, 54), tracks)]))
    baked = shown(draw_pixels(frame, tracks.height, tracks.width).rgb())
    shader = Shader.compiled(tmp_path)
    for quads in player.flakes("show", "fire", [0, 0.7]):
        picture = sum(shader.shown(quad, tracks.height) for quad in quads)
        np.testing.assert_allclose(as_bytes(np.asarray(picture)), baked, atol=0.5)


def test_flakes_fly_on_between_frames_and_over_the_end_of_a_loop(tmp_path: Path) -> None:
    player = player_of(Fire({"fire": 3}), tmp_path)
    tracks = some_tracks(3)
    moments = [0.0, 0.25, 1.5, 2.75, 3.0, 4.5, -0.25]
    same = [0.0, 0.25, 1.5, 2.75, 0.0, 1.5, 2.75]
    for quads, moment in zip(player.flakes("show", "fire", moments), same, strict=True):
        np.testing.assert_allclose(
            quads[:, :2], expected(tracks, moment, (30, 54))[:, :2], atol=0.02
        )


def test_the_flakes_of_all_rounds_are_played(tmp_path: Path) -> None:
    """Five frames of tracks and one more are three rounds of an animation of two."""
    player = player_of(Fire({"fire": 2}), tmp_path)
    tracks = some_tracks(5)
    tracks = replace(tracks, frames=(*tracks.frames, tracks.frames[0]), rounds=3)
    player.tracks.write_bytes(flake_bytes([AnimationFlakes("fire", (30, 54), tracks)]))
    moments = [0.0, 1.5, 2.0, 4.5, 5.0, 6.0, 9.5]
    assert player.lines("show", "fire", [0])[0].split()[0] == "2"
    shown, followed = (player.flakes(how, "fire", moments) for how in ("show", "play"))
    for alone, in_step, moment in zip(shown, followed, moments, strict=True):
        wanted = expected(tracks, moment, (30, 54))
        np.testing.assert_allclose(alone[:, :2], wanted[:, :2], atol=0.02)
        np.testing.assert_allclose(in_step[:, :2], wanted[:, :2] / 50, atol=1e-3)


def test_the_component_keeps_step_and_allocates_nothing(tmp_path: Path) -> None:
    player = player_of(Fire({"fire": 3}), tmp_path)
    tracks, moments = some_tracks(3), [0.0, 0.5, 2.0, 4.5]
    shown = player.flakes("play", "fire", moments)
    flipped = player.flakes("flip", "fire", moments)
    for quads, mirrored, moment in zip(shown, flipped, moments, strict=True):
        wanted = expected(tracks, moment % 3, (30, 54))
        np.testing.assert_allclose(quads[:, :2], wanted[:, :2] / 50, atol=1e-3)
        np.testing.assert_allclose(quads[:, LIGHT], wanted[:, LIGHT], rtol=2e-3)
        np.testing.assert_allclose(mirrored[:, X], -quads[:, X], atol=1e-6)
        np.testing.assert_allclose(mirrored[:, Y], quads[:, Y], atol=1e-6)
    assert player.lines("play", "fire", moments)[-1] == "sorting 8 collections 0"


def test_a_set_of_flakes_is_chosen_and_one_too_many_begins_again(tmp_path: Path) -> None:
    player = player_of(Fire({"fire": 3}), tmp_path)
    sets = [some_tracks(3), some_tracks(4), some_tracks(5)]
    states = [AnimationFlakes("other", (0, 0), some_tracks(3))]
    states += [AnimationFlakes("fire", (30, 54), tracks) for tracks in sets]
    player.tracks.write_bytes(flake_bytes([*states, AnimationFlakes("last", (0, 0), sets[0])]))
    for number in range(5):
        (quads,) = player.flakes("play", "fire", [1.25], str(number))
        wanted = expected(sets[number % 3], 1.25 * len(sets[number % 3].frames) / 3, (30, 54))
        np.testing.assert_allclose(quads[:, :2], wanted[:, :2] / 50, atol=1e-3)
    by_itself = player.lines("play", "fire", [1.25])[0]
    assert by_itself in {player.lines("play", "fire", [1.25], str(n))[0] for n in range(3)}


def test_a_state_without_flakes_shows_none(tmp_path: Path) -> None:
    player = player_of(Fire({"fire": 3}), tmp_path)
    assert player.lines("show", "other", [0, 1])[1:] == ["0", "0"]


def test_other_bytes_are_refused(tmp_path: Path) -> None:
    player = player_of(Fire({"fire": 3}), tmp_path)
    sound = player.tracks.read_bytes()
    for bytes_ in (b"", b"FAFL", b"PK" + sound[2:], sound[:4] + b"\1" + sound[5:]):
        player.tracks.write_bytes(bytes_)
        assert player.lines("show", "fire", [0]) == ["no tracks"]
        assert player.lines("play", "fire", [0]) == [
            "error: fire_flakes: tracks must be fire.flakes.bytes"
        ]


def test_numbers_beyond_half_precision_are_held(tmp_path: Path) -> None:
    tracks = some_tracks(2)
    tracks.frames[0][:, COLUMNS.index("r")] = 1e6
    player = player_of(Fire({"fire": 2}), tmp_path)
    player.tracks.write_bytes(flake_bytes([AnimationFlakes("fire", (0, 0), tracks)]))
    (quads,) = player.flakes("show", "fire", [0])
    assert quads[:, 6].max() == 65504
