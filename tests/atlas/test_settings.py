"""What cannot be had together is refused by ``check``, with the reason."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main


def checked(folder: Path, capsys: pytest.CaptureFixture[str], **keys: Any) -> tuple[int, str]:
    Image.fromarray(np.full((8, 8, 4), 200, np.uint8)).save(folder / "0.png")
    recipe = folder / "fire.yaml"
    recipe.write_text(json.dumps({"source": {"path": "0.png"}, **keys}), encoding="utf-8")
    code = main(["check", str(recipe)])
    return code, capsys.readouterr().err


@pytest.mark.parametrize(
    ("atlas", "exports", "advice"),
    [
        ({"layout": "grid", "rotate": True}, ["json"], "a grid shows every frame upright"),
        ({"layout": "grid", "border": 2}, ["json"], "padding is their gutter"),
        ({"layout": "grid", "dedupe": True}, ["json"], "one cell for every frame"),
        ({"rotate": True}, ["json", "phaser"], "phaser cannot be combined with atlas.rotate"),
        ({"rotate": True}, ["aseprite"], "aseprite cannot be combined with atlas.rotate"),
        ({"rotate": True}, ["css"], "css cannot be combined with atlas.rotate"),
        ({"rotate": True}, ["tpsheet"], "tpsheet cannot be combined with atlas.rotate"),
        ({"alpha": "premultiplied"}, ["css"], "straight alpha in sRGB"),
        ({"blend_space": "linear"}, ["css"], "straight alpha in sRGB"),
        ({"alpha": "additive", "bleed": 2}, ["json"], "alpha additive needs none"),
        ({"trim": "none", "trim_threshold": 3}, ["json"], "nothing is cut with trim none"),
        ({"quality": 80}, ["json"], "atlas.quality: PNG is always lossless; .*format to webp"),
        ({"format": "webp", "quality": 0}, ["json"], "atlas.quality: must be .*1"),
        ({"format": "webp", "quality": "best"}, ["json"], "atlas.quality: must be .*lossless"),
        ({"format": "webp", "quality": 80}, ["unity"], "unity does not import atlas.format webp"),
        ({"format": "webp", "max_size": 16384}, ["json"], "at most 16383 px a side"),
        ({"border": 8, "max_size": 16}, ["json"], "leave nothing of max_size"),
        ({"scales": [0.5]}, ["json"], "must hold 1"),
        ({"scales": [1, 0.3]}, ["json"], "must be of 1, 0.5, 0.25, 0.125"),
        ({"scales": [1, 0.5, 0.5]}, ["json"], "0.5 is listed twice"),
        ({"pivot": "middle"}, ["json"], "must be one of base, bottom, center, top"),
        ({"pivot": 3}, ["json"], r"two numbers: \[x, y\]"),
        ({"multiple_of": 3}, ["json"], "1, 2"),
        ({}, ["jsn"], "did you mean json"),
        ({}, [3], "the name of a format, {unity: ...}, {css: ...}, or {template"),
        ({}, [{"template": "x.j2"}], "exports.0.to: is missing"),
        ({}, [{"template": "x.j2", "to": "x"}], r"there is no template .*x\.j2"),
    ],
)
def test_a_contradiction_is_refused_with_its_reason(
    atlas: dict[str, Any],
    exports: list[Any],
    advice: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    code, said = checked(tmp_path, capsys, atlas=atlas, exports=exports)
    assert code in {1, 2}
    assert "fire.yaml:1" in said
    assert re.search(advice, said), said


@pytest.mark.parametrize(
    ("keys", "extra"),
    [({"atlas": {"compression": "small"}}, "small"), ({"maps": {"emission": "exr"}}, "exr")],
)
def test_a_missing_extra_is_reported_before_any_work(
    keys: dict[str, Any],
    extra: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("fire_atlas.formats.problems.find_spec", lambda name: None)
    code, said = checked(tmp_path, capsys, **keys)
    assert (code, f"pip install 'fire-atlas[{extra}]'" in said) == (1, True)
    assert f"{next(iter(keys))}." in said
    for command in (["build"], ["build", "--dry-run"], ["preview"]):
        assert main([*command, str(tmp_path / "fire.yaml")]) == 1
        assert capsys.readouterr().err == said
    assert not (tmp_path / "build").exists()


@pytest.mark.parametrize(
    "atlas",
    [
        {"layout": "grid", "pot": True, "square": True, "multiple_of": 4, "trim": "none"},
        {"layout": "grid", "dedupe": False, "extrude": 2, "bleed": 2, "scales": [1, 0.25]},
        {"rotate": True, "border": 4, "square": True, "pivot": [0.5, 0.8]},
        {"format": "webp", "compression": "small", "alpha": "additive", "quality": 50},
        {"format": "png", "quality": "lossless"},
    ],
)
def test_what_goes_together_is_accepted(
    atlas: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = checked(tmp_path, capsys, atlas=atlas)
    assert (code, said) == (0, "")
