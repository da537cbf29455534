"""Heat in Unity: its shader looks colours up in the ramp, as our own look-up does."""

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.cli import main
from fire_atlas.engines.unity.names import guids_in
from tests.engines.unity.type_trees import faults, importer
from tests.support.heats import RAMPS, HeatFire, Values, built

FRAME = 5

_PROGRAM = """
using System;
using System.Globalization;
struct float2 { public float x, y; }
static class Shader
{
    static float max(double a, double b) { return (float)Math.Max(a, b); }
    static float2 float2(double x, double y) { return new float2 { x = (float)x, y = (float)y }; }
    FUNCTIONS
    static void Main()
    {
        var point = CultureInfo.InvariantCulture;
        string line;
        while ((line = Console.ReadLine()) != null)
        {
            float[] n = Array.ConvertAll(line.Split(' '), each => float.Parse(each, point));
            float2 at = OnRamp(n[0], n[1], n[2], float2(n[3], n[4]));
            Console.WriteLine(string.Format(point, "{0:R} {1:R}", at.x, at.y));
        }
    }
}
"""


@pytest.fixture(scope="module")
def assets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("heat")
    built(folder, exports=["json", "unity"])
    return folder


class Shader:
    """The function of the shader that finds a place in the ramp, run by Mono."""

    def __init__(self, shader: str, folder: Path) -> None:
        """Compile it."""
        function = shader[shader.index("float2 OnRamp") : shader.index("ENDHLSL")]
        source, self._program = folder / "Shader.cs", folder / "Shader.exe"
        source.write_text(_PROGRAM.replace("FUNCTIONS", f"static {function}"))
        subprocess.run(
            ["mcs", "-langversion:7.2", f"-out:{self._program}", str(source)],
            capture_output=True, check=True,
        )  # fmt: skip

    def light(self, heat: Values, erosion: float, row: int, ramps: Values) -> Values:
        """Return the colours (n, 4) of heat (n,): those of the ramp, filtered as a GPU filters."""
        rows = len(ramps)
        lines = [f"{each} {erosion} {row} 256 {rows}" for each in heat.tolist()]
        ran = subprocess.run(
            ["mono", str(self._program)],
            input="\n".join(lines), capture_output=True, text=True, check=True,
        )  # fmt: skip
        uv = np.array([line.split() for line in ran.stdout.splitlines()], float)
        return bilinear(ramps[::-1], uv)


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


def test_its_shader_finds_the_colours_of_six_ramps_and_erodes(
    mono: None, assets: Path, tmp_path: Path
) -> None:
    shader = Shader((assets / "fire.heat.shader").read_text(), tmp_path)
    fire = HeatFire(assets)
    heat = np.unique(fire.heat(FRAME))
    assert len(heat) > 150
    for row in range(len(RAMPS)):
        for erosion in (0.0, 0.3, 1.0):
            seen = shader.light(heat, erosion, row, fire.ramps)
            wanted = fire.light(np.maximum(heat - erosion, 0), row)[0]
            assert np.abs(seen - wanted).max() < 0.5 / 255, (RAMPS[row], erosion)
    assert shader.light(heat, 1.0, 0, fire.ramps).max() == 0, "nothing is left"


def test_both_pipelines_look_up_alike(assets: Path) -> None:
    urp, built_in = (assets / "fire.heat.shader").read_text().split("    SubShader\n")[1:]
    assert '"RenderPipeline" = "UniversalPipeline"' in urp
    assert "RenderPipeline" not in built_in
    for text in (urp, built_in):
        assert "OnRamp(heat, _Erosion, _Row, _RampTex_TexelSize.zw)" in text
        assert "Blend One OneMinusSrcAlpha" in text
        assert text.count("HLSLPROGRAM") == text.count("ENDHLSL") == 1


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


def test_heat4_is_refused_with_advice(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recipe = tmp_path / "fire.yaml"
    keys = {"source": {"path": "clip"}, "atlas": {"pixels": "heat4"}, "exports": ["unity"]}
    recipe.write_text(json.dumps(keys))
    assert main(["check", str(recipe)]) != 0
    assert "it cannot play atlas.pixels heat4; set it to heat" in capsys.readouterr().err
