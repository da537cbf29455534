"""Heat in Unity: its player and shader show the colours that our own look-up has.

The player is run by Mono against stubs, and the functions of the shader, too; sampling is ours.
"""

import re
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.engines.unity.names import guids_in
from tests.engines.unity import mcs
from tests.engines.unity.mcs import CSHARP, STUBS
from tests.engines.unity.type_trees import documents, faults, importer
from tests.support.heats import RAMPS, HeatFire, Values, built

UNITS = 50.0
"""Pixels a unit of the builds here."""

MOMENTS = [0.0, 5.0, 5.25, 7.5, 11.75, 47.5]
"""The last is between the last frame and the first; 7.5 and 11.75 are between cells of heat4."""


@pytest.fixture(scope="module", params=["heat", "heat4"])
def assets(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp(request.param)
    options = {"unity": {"pixels_per_unit": UNITS}}
    built(folder, exports=["json", options], atlas={"pixels": request.param})
    return folder


class Shader:
    """The functions of the shader, run by Mono."""

    def __init__(self, shader: str, folder: Path) -> None:
        """Compile them."""
        functions = shader[shader.index("    float3 OnPage") : shader.index("ENDHLSL")]
        functions = re.sub(
            r"^    (float\d? \w+\()", r"    static \1", functions, flags=re.MULTILINE
        )
        around = (CSHARP / "HeatShader.cs").read_text(encoding="utf-8")
        self._program = folder / "Shader.exe"
        mcs.compiled(self._program, {"Shader.cs": around.replace("FUNCTIONS", functions)})

    def on_page(self, at: Values, place: Sequence[float], page: Sequence[float]) -> Values:
        """Return uv and whether the page has it, (n, 3), of places (n, 2) in units."""
        return self._run([*each, *place, *page] for each in at.tolist())

    def light(
        self, here: Values, next_: Values, blend: float, erosion: float, row: int, ramps: Values
    ) -> Values:
        """Return the colours (n, 4) of heat (n,) between two frames, filtered as a GPU filters."""
        heats = zip(here.tolist(), next_.tolist(), strict=True)
        uv = self._run([*each, blend, erosion, row, 256, len(ramps)] for each in heats)
        return bilinear(ramps[::-1], uv)

    def _run(self, rows: Iterable[Sequence[float]]) -> Values:
        ran = subprocess.run(
            ["mono", str(self._program)], input="\n".join(" ".join(map(repr, row)) for row in rows),
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        return np.array([line.split() for line in ran.stdout.splitlines()], float)


class Player:
    """The player of a build, with the sprites of its prefab, run by Mono."""

    def __init__(self, assets: Path, folder: Path, name: str = "fire") -> None:
        """Compile it."""
        self._frames = list(frames_of_prefab(assets, name))
        text = (CSHARP / "HeatHarness.cs").read_text(encoding="utf-8")
        alias = f"using Player = FireAtlas.{name}_heat;\n\nstatic class"
        scripts = (assets / f"{name}_heat.cs", *STUBS)
        sources = {path.name: path.read_text(encoding="utf-8") for path in scripts}
        sources["Harness.cs"] = text.replace("static class", alias, 1)
        self._program = folder / "Player.exe"
        mcs.compiled(self._program, sources, *mcs.STRICT)

    def lines(
        self,
        moments: Sequence[float],
        how: str = "loop",
        side: str = "plain",
        state: str = "fire",
    ) -> list[str]:
        """Return what the harness prints."""
        ran = subprocess.run(
            ["mono", str(self._program), state, how, side, ",".join(map(repr, moments))],
            input="\n".join(self._frames), capture_output=True, text=True, check=True,
        )  # fmt: skip
        return ran.stdout.splitlines()

    def properties(
        self,
        moments: Sequence[float],
        how: str = "loop",
        side: str = "plain",
        state: str = "fire",
    ) -> list[dict[str, list[float]]]:
        """Return the properties that the shader gets at each moment."""
        found: list[dict[str, list[float]]] = [{}]
        for line in self.lines(moments, how, side, state):
            name, *numbers = line.split()
            if name == "end":
                found.append({})
            else:
                found[-1][name] = list(map(float, numbers))
        return found[:-1]


def frames_of_prefab(assets: Path, name: str) -> Iterable[str]:
    """Yield the frames of a prefab's player as the harness reads them."""
    meta = (assets / f"{name}.png.meta").read_text()
    sprites = {each["internalID"]: each for each in importer(meta)[1]["spriteSheet"]["sprites"]}
    with Image.open(assets / f"{name}.png") as image:
        size = image.size
    scripts = [
        fields
        for kind, _, fields in documents((assets / f"{name}.prefab").read_text())
        if kind == 114
    ]
    (player,) = (fields for fields in scripts if "states" in fields)
    for state in player["states"]:
        for frame in state["frames"]:
            assert frame["sprite"]["guid"] == guids_in(meta)[0]
            sprite = sprites[frame["sprite"]["fileID"]]
            rect = [float(sprite["rect"][key]) for key in ("x", "y", "width", "height")]
            pivot = [sprite["pivot"]["x"] * rect[2], sprite["pivot"]["y"] * rect[3]]
            numbers = [*rect, *pivot, *size, UNITS, frame["channel"]]
            yield " ".join([state["name"], *map(repr, numbers)])


def bilinear(texture: Values, uv: NDArray[np.float64]) -> Values:
    """Sample a texture whose first row is at v = 0, as Unity has it, clamped."""
    rows, columns = texture.shape[:2]
    x = (uv[:, 0] * columns - 0.5).clip(0, columns - 1)
    y = (uv[:, 1] * rows - 0.5).clip(0, rows - 1)
    left, below = x.astype(int), y.astype(int)
    right, above = np.minimum(left + 1, columns - 1), np.minimum(below + 1, rows - 1)
    fx, fy = (x - left)[:, None], (y - below)[:, None]
    low = texture[below, left] * (1 - fx) + texture[below, right] * fx
    high = texture[above, left] * (1 - fx) + texture[above, right] * fx
    return np.asarray(low * (1 - fy) + high * fy)


def places(fire: HeatFire) -> Values:
    """Return where the middles of a frame's pixels are, (n, 2): units from the pivot, y up."""
    frame = fire.frames[0]
    y, x = np.mgrid[: frame.frame_height, : frame.frame_width] + 0.5
    pivot = frame.anchor[0] * frame.frame_width, frame.anchor[1] * frame.frame_height
    return np.stack([x - pivot[0], pivot[1] - y], axis=-1).reshape(-1, 2) / UNITS


def sampled(page: Values, on: Values, channel: Sequence[float]) -> Values:
    """Return the heat (n,) of places on a page, as a shader samples it without filter."""
    height, width = page.shape[:2]
    x = np.floor(on[:, 0] * width + 1e-3).astype(int).clip(0, width - 1)
    y = np.floor((1 - on[:, 1]) * height + 1e-3).astype(int).clip(0, height - 1)
    return np.asarray(page[y, x] @ np.array(channel) * on[:, 2])


def test_what_is_shown_is_heat_between_frames_in_the_colours_of_a_ramp(
    mono: None, assets: Path, tmp_path: Path
) -> None:
    fire, player = HeatFire(assets), Player(assets, tmp_path)
    shader = Shader((assets / "fire.heat.shader").read_text(), tmp_path)
    with Image.open(assets / "fire.png") as image:
        page = np.asarray(image.convert("RGBA")) / 255
    count = len(fire.frames)
    for moment, given in zip(MOMENTS, player.properties(MOMENTS), strict=True):
        moment %= count
        blend, here, next_ = moment % 1, int(moment), (int(moment) + 1) % count
        assert given["_Blend"][0] == pytest.approx(blend, abs=1e-4)
        first, second = (
            sampled(
                page,
                shader.on_page(places(fire), given[f"{side}Place"], given[f"{side}Page"]),
                given[f"{side}Channel"],
            )
            for side in ("_Here", "_Next")
        )
        np.testing.assert_array_equal(first, fire.heat(here).ravel())
        np.testing.assert_array_equal(second, fire.heat(next_).ravel())
        mixed = first * (1 - blend) + second * blend
        row = int(moment) % len(RAMPS)
        seen = shader.light(first, second, given["_Blend"][0], 0.0, row, fire.ramps)
        assert np.abs(seen - fire.light(mixed, row)[0]).max() < 0.5 / 255


def test_it_shows_six_ramps_and_erodes(mono: None, assets: Path, tmp_path: Path) -> None:
    shader = Shader((assets / "fire.heat.shader").read_text(), tmp_path)
    fire = HeatFire(assets)
    heat = np.unique(fire.heat(5))
    assert len(heat) > 150
    for row in range(len(RAMPS)):
        for erosion in (0.0, 0.3, 1.0):
            seen = shader.light(heat, heat, 0, erosion, row, fire.ramps)
            wanted = fire.light(np.maximum(heat - erosion, 0), row)[0]
            assert np.abs(seen - wanted).max() < 0.5 / 255, (RAMPS[row], erosion)
    assert shader.light(heat, heat, 0, 1.0, 0, fire.ramps).max() == 0, "nothing is left"


def test_the_player_follows_and_allocates_nothing(mono: None, assets: Path, tmp_path: Path) -> None:
    fire, player = HeatFire(assets), Player(assets, tmp_path)
    count = len(fire.frames)
    (flipped,) = player.properties([2.5], side="flip")
    assert flipped["_Flip"][:2] == [-1, 1] and flipped["_SpriteColor"] == [1, 0.5, 0.25, 0.75]
    (last,) = player.properties([count + 3.0], how="once")
    assert last["_HerePage"] == last["_NextPage"], "what plays once stays at its end"
    *_, sorting, collections = lines = player.lines([0.0])
    assert (sorting, collections) == ("sorting 7", "collections 0")
    corners = np.array([line.split()[1:] for line in lines if line.startswith("corner")], float)
    for each in fire.frames:
        x = np.array([each.trim_x, each.trim_x + each.width]) - each.anchor[0] * each.frame_width
        y = each.anchor[1] * each.frame_height - np.array([each.trim_y, each.trim_y + each.height])
        for seen, of in zip(corners.T, (x / UNITS, y / UNITS), strict=True):
            assert seen.min() <= of.min() + 1e-4 and seen.max() >= of.max() - 1e-4


def test_the_sprite_keeps_time_but_is_not_drawn(assets: Path) -> None:
    objects = documents((assets / "fire.prefab").read_text())
    drawn = {kind: fields["m_Enabled"] for kind, _, fields in objects if kind in (23, 212)}
    assert drawn == {212: 0, 23: 1}


def test_heat_is_imported_as_data_and_the_ramp_as_colours(assets: Path) -> None:
    page, ramp = ((assets / f"fire{kind}.png.meta").read_text() for kind in ("", ".ramp"))
    assert faults("fire.png.meta", page) == faults("fire.ramp.png.meta", ramp) == []
    for text, srgb, mode in ((page, 0, 2), (ramp, 1, 0)):
        fields = importer(text)[1]
        assert (fields["mipmaps"]["sRGBTexture"], fields["spriteMode"]) == (srgb, mode)
        assert fields["mipmaps"]["enableMipMap"] == fields["alphaIsTransparency"] == 0
        assert fields["platformSettings"][0]["textureCompression"] == 0
        assert fields["textureSettings"]["wrapU"] == 1, "clamped"
    material = (assets / "fire.heat.mat").read_text()
    assert faults("fire.heat.mat", material) == []
    for file in ("fire.heat.shader.meta", "fire.ramp.png.meta"):
        assert guids_in((assets / file).read_text())[0] in material
    prefab = (assets / "fire.prefab").read_text()
    assert guids_in((assets / "fire.heat.mat.meta").read_text())[0] in prefab
    assert not (assets / "fire.mat").exists()


def test_a_material_that_a_user_changed_is_kept(tmp_path: Path) -> None:
    built(tmp_path, exports=["unity"])
    path = tmp_path / "fire.heat.mat"
    path.write_text(re.sub("_Row: 0", "_Row: 3", path.read_text()))
    built(tmp_path, exports=["unity"], atlas={"ramp": RAMPS[:4]})
    assert "_Row: 3" in path.read_text()
