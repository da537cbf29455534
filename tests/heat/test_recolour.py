"""Flames in the colours of ramps: where heat is known, what is left as it is, and what follows."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.atlas.encode import encode_frame
from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes, srgb_of, srgb_to_linear
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.heat.ready import ready_light
from fire_atlas.preview.cut_frames import cut_frames
from fire_atlas.recipe.ramps import READY_RAMPS
from tests.support.cover import hidden_by_light

SIDE = 64
PLAIN: dict[str, Any] = {"flakes": "none", "timeline": {"loop": "none"}}


def build(folder: Path, **recipe: Any) -> Path:
    """Build a recipe called fire; return the JSON of its atlas."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "fire.yaml"
    path.write_text(yaml.safe_dump({"exports": ["json"], **recipe}))
    assert main(["build", str(path), "-q"]) == 0
    return folder / "build" / "fire.json"


def frames_of(atlas: Path) -> list[Bytes]:
    return list(cut_frames(read_atlas(atlas)))


def added(image: Bytes, blend_space: str) -> NDArray[np.float64]:
    """Return straight bytes (h, w, 4) as those that a client adds over black, 0..255."""
    values = image.astype(np.float64)
    if blend_space == "linear":
        light = srgb_to_linear(image[..., :3] / 255) * (image[..., 3:] / 255)
        values[..., :3] = 255 * srgb_of(light)
    else:
        values[..., :3] *= values[..., 3:] / 255
    return values


def ramp_of(name: str, blend_space: Any) -> Bytes:
    """Return a ready ramp (256, 4), premultiplied; in pages of heat its entries differ less."""
    return np.asarray(encode_frame(ready_light(name)[None], "premultiplied", blend_space)[0])


def known_heat(i: int) -> NDArray[np.intp]:
    """Heat (h, w), 0..255, of frame i: each from left to right, moving upwards in waves."""
    y, x = np.mgrid[:SIDE, :SIDE]
    wave = 0.5 + 0.5 * np.sin(2 * np.pi * (y / 16 + i / 6))
    return np.asarray(np.rint((x / (SIDE - 1)) * (0.6 + 0.4 * wave) * 255), np.intp)


def clip_of_known_heat(folder: Path, ramp: Bytes, blend_space: str) -> dict[str, Any]:
    """Write a clip whose heat has the colours of a premultiplied ramp (256, 4), straight."""
    folder.mkdir(parents=True)
    cover = np.maximum(ramp[:, 3:] / 255, 1e-9)
    if blend_space == "linear":
        colour = srgb_of(np.minimum(srgb_to_linear(ramp[:, :3] / 255) / cover, 1))
    else:
        colour = np.minimum(ramp[:, :3] / 255 / cover, 1)
    straight = np.hstack([np.rint(colour * 255), ramp[:, 3:]])
    for i in range(6):
        image = Image.fromarray(straight[known_heat(i)].astype(np.uint8))
        image.save(folder / f"{i:04}.png")
    return {"path": str(folder), "fps": 12}


@pytest.mark.parametrize("blend_space", ["srgb", "linear"])
@pytest.mark.parametrize("alpha", ["straight", "premultiplied"])
def test_each_pixel_of_known_heat_has_the_colour_of_a_ramp_there(
    tmp_path: Path, alpha: Any, blend_space: Any
) -> None:
    natural = ramp_of("campfire", blend_space)
    source = clip_of_known_heat(tmp_path / "clip", natural, blend_space)
    atlas = {"alpha": alpha, "blend_space": blend_space, "trim": "none"}
    atlas |= {"cover": "full"} if alpha == "premultiplied" else {}
    composite = {"ramp": list(READY_RAMPS)}
    built = frames_of(build(tmp_path, source=source, atlas=atlas, composite=composite, **PLAIN))
    for place, name in enumerate(READY_RAMPS):
        ramp = ramp_of(name, blend_space).astype(float)
        for i in range(6):
            frame = built[6 * place + i]
            seen = added(frame, blend_space) if alpha == "straight" else frame.astype(float)
            wanted = ramp[known_heat(i)]
            off = np.abs(seen - wanted)
            # What hides all behind it does so in any colours.
            off[..., 3][source_alpha(tmp_path, i) == 255] = 0
            assert off.max() <= 2, name


def source_alpha(folder: Path, i: int) -> Bytes:
    return np.asarray(Image.open(folder / "clip" / f"{i:04}.png"))[..., 3]


def test_grey_fire_on_black_takes_all_colours_of_a_list(tmp_path: Path) -> None:
    (tmp_path / "clip").mkdir()
    for i in range(6):
        grey = np.repeat(known_heat(i).astype(np.uint8)[..., None], 3, axis=2)
        Image.fromarray(grey).save(tmp_path / "clip" / f"{i:04}.png")
    source = {"path": str(tmp_path / "clip"), "fps": 12, "matte": "luminance"}
    colours = ["#0000ff", "#00ffff"]
    atlas = {"alpha": "premultiplied", "trim": "none"}
    built = frames_of(
        build(tmp_path, source=source, atlas=atlas, composite={"ramp": colours}, **PLAIN)
    )
    # From blue to cyan, as dense as the natural fire which is as bright.
    natural = ready_light("campfire").astype(np.float64)
    straight = srgb_of(natural[:, :3] / np.maximum(natural[:, 3:], 1e-9))
    brightness = 255 * (straight * natural[:, 3:]).mean(axis=1)
    for i in range(6):
        heat = np.interp(known_heat(i), brightness, np.linspace(0, 1, 256))
        cover = np.interp(heat, np.linspace(0, 1, 256), natural[:, 3])
        wanted = 255 * np.stack([0 * heat, heat * cover, cover], axis=-1)
        off = np.abs(built[i][..., :3] - wanted)
        assert off[known_heat(i) > 4].max() <= 2  # what is darker counts as black
        # From blue to cyan, thin fire covers less than that.
        luminance = 0.7152 * heat + 0.0722
        hides = hidden_by_light(cover, cover * luminance)
        off = np.abs(255 * hides - built[i][..., 3])
        assert off[known_heat(i) > 4].max() <= 2


def sample(name: str, **keys: Any) -> dict[str, Any]:
    return {"path": str(shipped("samples") / name), "fps": 24, **keys}


def test_smoke_and_a_wick_are_unchanged_to_the_byte(tmp_path: Path) -> None:
    for name, keys in (("explosion", {}), ("candle", {"count": 6})):
        recipe = {"source": sample(name, **keys), "atlas": {"trim": "none"}, **PLAIN}
        own = frames_of(build(tmp_path / f"{name}_own", **recipe))
        blue = frames_of(build(tmp_path / name, composite={"ramp": "gas"}, **recipe))
        pale = changed = 0
        for before, after in zip(own, blue, strict=True):
            colour, cover = before[..., :3].astype(int), before[..., 3]
            is_pale = 3 * colour.min(axis=2) >= 2 * colour.max(axis=2)
            is_dark = (cover > 100) & (colour.max(axis=2) < 90)
            np.testing.assert_array_equal(before[is_pale & is_dark], after[is_pale & is_dark])
            pale += int(np.count_nonzero(is_pale & is_dark))
            changed += int(np.count_nonzero((before != after).any(axis=2)))
        assert pale > 50 and changed > 2000


def test_red_wax_on_black_footage_stays_red(tmp_path: Path) -> None:
    (tmp_path / "clip").mkdir()
    natural = ramp_of("campfire", "srgb")[:, :3]
    y, x = np.mgrid[:128, :128]
    for i in range(8):
        tip = 30 + 12 * np.sin(2 * np.pi * i / 8)
        sway = 7 * np.sin(2 * np.pi * (i / 8 + y / 60))
        flame = np.clip(1 - np.abs(x - 64 - sway) / 10, 0, 1) * ((y > tip) & (y < 90))
        picture = natural[np.rint(255 * flame).astype(int)]
        picture[96:, 40:88] = 170, 44, 30
        Image.fromarray(picture).save(tmp_path / "clip" / f"{i:04}.png")
    source = {"path": str(tmp_path / "clip"), "fps": 12, "matte": "luminance"}
    recipe = {"source": source, "atlas": {"trim": "none"}, **PLAIN}
    own = frames_of(build(tmp_path / "own", **recipe))
    blue = frames_of(build(tmp_path / "blue", composite={"ramp": "gas"}, **recipe))
    for before, after in zip(own, blue, strict=True):
        np.testing.assert_array_equal(before[98:, 42:86], after[98:, 42:86])
        core = after[50:88, 50:78].reshape(-1, 4).astype(int)
        assert (core[:, 2] >= core[:, 0]).all(), "the flame is blue"


@pytest.mark.slow
def test_logs_and_wax_that_are_drawn_with_the_fire_are_unchanged(tmp_path: Path) -> None:
    intruders = [
        {"shape": "log", "at": [-0.2, 0, 0.05], "radius": 0.05, "length": 0.3, "strength": 0},
        {"shape": "wax", "at": [0.25, 0, -0.1], "tilt": 90, "radius": 0.1, "length": 0.2,
         "strength": 0},
    ]  # fmt: skip
    source = {
        "kind": "silk", "width": 128, "height": 128, "foot": 0.2, "glow": 0.03, "intensity": 4,
        "sheets": {"arrangement": "crossed", "count": 3, "width": 0.3, "height": 0.7},
        "intruders": intruders,
    }  # fmt: skip
    recipe = {
        "source": source, "timeline": {"frames": 3, "fps": 8, "loop": "none"},
        "flakes": "none", "atlas": {"trim": "none"},
    }  # fmt: skip
    own = frames_of(build(tmp_path / "own", **recipe))
    blue = frames_of(build(tmp_path / "blue", composite={"ramp": "gas"}, **recipe))
    for before, after in zip(own, blue, strict=True):
        is_solid = before[..., 3] == 255
        same = (before == after).all(axis=2)
        beside = np.zeros_like(same)
        beside[:, :40] = beside[:, 96:] = True  # where no flame is before them
        assert np.count_nonzero(is_solid & beside) > 450
        assert same[is_solid & beside].all()
        flame = (before[..., 3] > 40) & ~beside
        flame[80:] = False  # where the log and the candle are
        assert np.count_nonzero(flame) > 300
        assert (after[flame][:, 2] >= after[flame][:, 0]).all(), "blue, not red"


def test_several_ramps_are_animations_with_the_same_flakes(tmp_path: Path) -> None:
    recipe = {
        "source": sample("campfire", count=6, height=96), "timeline": {"loop": "none"},
        "flakes": {"rate": 200, "bake": True}, "tracks": ["json", "light"],
        "atlas": {"alpha": "premultiplied", "trim": "none"},
    }  # fmt: skip
    ramps = ["soul", {"hue": 200}, ["#103010", "#e0ffe0"]]
    several = build(tmp_path / "several", composite={"ramp": ramps}, **recipe)
    animations = json.loads(several.read_text())["animations"]
    names = ["soul", "hue_200", "ramp_2"]
    assert list(animations) == names
    assert animations["hue_200"] == [f"fire/hue_200/{i:04}" for i in range(6)]
    frames = frames_of(several)
    paths = []
    for place, (name, ramp) in enumerate(zip(names, ramps, strict=True)):
        one = build(tmp_path / name, composite={"ramp": ramp}, **recipe)
        np.testing.assert_array_equal(frames_of(one), frames[6 * place : 6 * place + 6])
        tracks = json.loads(one.with_name("fire.flakes.json").read_text())
        shared = json.loads(several.with_name(f"fire.{name}.flakes.json").read_text())
        assert tracks["frames"] == shared["frames"]
        columns = [tracks["columns"].index(column) for column in ("id", "x", "y", "size", "a")]
        paths.append([[[row[c] for c in columns] for row in f["rows"]] for f in tracks["frames"]])
    assert paths[0] == paths[1] == paths[2] and any(paths[0])


def test_sparks_have_the_hue_of_the_ramp_and_the_light_they_had(tmp_path: Path) -> None:
    recipe = {
        "source": sample("campfire", count=6, height=96), "timeline": {"loop": "none"},
        "flakes": {"rate": 200}, "tracks": ["json"],
    }  # fmt: skip
    own, blue = (
        json.loads(build(tmp_path / name, composite={"ramp": ramp}, **recipe)
                   .with_name("fire.flakes.json").read_text())
        for name, ramp in (("own", "none"), ("blue", {"hue": 240}))
    )  # fmt: skip
    rgb = [own["columns"].index(channel) for channel in "rgb"]
    rows = [
        np.array([row for frame in tracks["frames"] for row in frame["rows"]])[:, rgb]
        for tracks in (own, blue)
    ]
    assert len(rows[0]) > 20
    np.testing.assert_allclose(rows[0].max(axis=1), rows[1].max(axis=1), rtol=0.01, atol=1e-3)
    assert (rows[0].argmax(axis=1) == 0).all() and (rows[1].argmax(axis=1) == 2).all()
    np.testing.assert_allclose(rows[1][:, 0], rows[1][:, 1], atol=0.01 * rows[1].max())


def test_the_light_track_is_the_mean_of_the_built_frames(tmp_path: Path) -> None:
    recipe = {
        "source": sample("campfire", count=6, height=96), "timeline": {"loop": "none"},
        "flakes": {"rate": 100}, "tracks": ["light"],
        "atlas": {"alpha": "premultiplied", "blend_space": "linear", "bits": 16},
    }  # fmt: skip
    atlas = build(tmp_path, composite={"ramp": "frost"}, **recipe)
    light = [srgb_to_linear(f[..., :3] / 255).sum(axis=(0, 1)) for f in frames_of(atlas)]
    stated = json.loads(atlas.with_name("fire.light.json").read_text())
    mean = np.mean(light, axis=0)
    colour = [stated["mean"][c] for c in "rgb"]
    np.testing.assert_allclose(colour, mean / mean.max(), atol=0.01)
    assert colour[2] == 1 and colour[0] < 0.9
    for frame, seen in zip(stated["frames"], light, strict=True):
        assert frame["intensity"] == pytest.approx(seen.max() / mean.max(), rel=0.01)


def test_pixel_art_stays_pixel_art(tmp_path: Path) -> None:
    source = {**sample("pixel_flame.png"), "grid": {"columns": 8, "rows": 1}}
    recipe = {"source": source, "atlas": {"trim": "none"}, "flakes": "none"}
    own = np.array(frames_of(build(tmp_path / "own", **recipe)))
    recipe["composite"] = {"ramp": "gas"}
    blue = np.array(frames_of(build(tmp_path / "blue", **recipe)))
    np.testing.assert_array_equal(own[..., 3], blue[..., 3])
    pairs = np.unique(np.concatenate([own, blue], axis=3).reshape(-1, 8), axis=0)
    assert len(pairs) == len(np.unique(pairs[:, :4], axis=0)), "each colour becomes one other"
    assert (blue[..., 2] >= blue[..., 0]).all()
    recipe["flakes"] = {"rate": 40}
    sparks = np.array(frames_of(build(tmp_path / "sparks", **recipe)))
    assert (sparks != blue).any()
    assert set(map(tuple, sparks.reshape(-1, 4))) <= set(map(tuple, pairs[:, 4:]))


def test_an_image_is_a_ramp_and_is_followed_when_it_changes(tmp_path: Path) -> None:
    picture = np.zeros((3, 64, 3), np.uint8)
    picture[:, 32:, 1] = 200  # black, then green, without anything between
    Image.fromarray(picture).save(tmp_path / "green.png")
    recipe = {
        "source": sample("campfire", count=2, height=96),
        "composite": {"ramp": "green.png"}, **PLAIN,
    }  # fmt: skip
    frames = frames_of(build(tmp_path, **recipe))
    greens = [frame[..., 1][frame[..., 3] > 0] for frame in frames]
    assert all(frame[..., [0, 2]].max() == 0 for frame in frames)
    assert max(green.max() for green in greens) == 255  # of 200 over black, straight
    manifest = json.loads((tmp_path / "build" / "fire.manifest.json").read_text())
    assert any(each["path"].endswith("green.png") for each in manifest["inputs"])
    picture[..., 2] = picture[..., 1]
    Image.fromarray(picture).save(tmp_path / "green.png")
    changed = frames_of(build(tmp_path, **recipe))
    assert max(frame[..., 2].max() for frame in changed) == 255


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"composite": {"ramp": "#2040ff"}}, ["composite.ramp", "in a list", "#2040ff"]),
        ({"composite": {"ramp": ["#2040ff", "#20"]}}, ["composite.ramp", "colour like"]),
        ({"composite": {"ramp": ["soul", "#2040ff"]}}, ["composite.ramp.1", "in a list"]),
        ({"composite": {"ramp": []}}, ["composite.ramp", "at least 1"]),
        ({"composite": {"ramp": {"hue": 400}}}, ["composite.ramp.hue", "at most 360"]),
        ({"composite": {"ramp": {"hues": 4}}}, ["composite.ramp.hues", "hue"]),
        ({"composite": {"ramp": 200}}, ["composite.ramp", "{hue: degrees}"]),
        ({"composite": {"ramp": ["soul", "a/soul.png"]}}, ["composite.ramp.1", "called soul too"]),
        ({"composite": {"ramp": ["a/b c.png"]}}, ["composite.ramp.0", "plain name"]),
        ({"composite": {"ramp": "soul"}, "atlas": {"pixels": "heat"}},
         ["composite.ramp", "atlas.ramp"]),
        ({"composite": {"ramp": ["soul"]}, "wind": {"levels": [0, 2]},
          "source": {"kind": "silk", "sheets": {"arrangement": "ring", "count": 3}}},
         ["composite.ramp", "one ramp, not in a list"]),
    ],
)  # fmt: skip
def test_what_is_no_ramp_is_refused_by_check_and_build_alike(
    keys: dict[str, Any], words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "fire.yaml"
    path.write_text(yaml.safe_dump({"source": sample("campfire"), **keys}))
    errors = []
    for command in (["check"], ["build", "-q"]):
        assert main([*command, str(path)]) in (1, 2)
        errors.append(capsys.readouterr().err)
    assert errors[0] == errors[1]
    assert all(word in errors[0] for word in ("fire.yaml:", *words)), errors[0]


def test_an_image_that_is_missing_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "fire.yaml"
    recipe = {"source": sample("campfire"), "composite": {"ramp": ["soul", "sol"]}}
    path.write_text(yaml.safe_dump(recipe))
    assert main(["build", "-q", str(path)]) == 1
    error = capsys.readouterr().err
    assert "composite.ramp.1: sol is neither a ready ramp (campfire, gas," in error


def test_a_member_in_a_ramp_is_refused_where_pages_store_heat(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    member = {"source": sample("campfire"), "composite": {"ramp": "soul"}}
    (tmp_path / "member.yaml").write_text(yaml.safe_dump(member))
    host = {"atlas": {"members": ["member.yaml"], "pixels": "heat"}}
    (tmp_path / "host.yaml").write_text(yaml.safe_dump(host))
    assert main(["check", str(tmp_path / "host.yaml")]) == 2
    assert "atlas.members.0: composite.ramp" in capsys.readouterr().err


WOOD = (70, 52, 38, 255)


@pytest.mark.parametrize("pixels", ["heat", "heat4"])
def test_wood_stays_wood_in_pages_of_heat(pixels: str, tmp_path: Path) -> None:
    natural = ramp_of("campfire", "srgb")
    source = clip_of_known_heat(tmp_path / "clip", natural, "srgb")
    for path in (tmp_path / "clip").iterdir():
        picture = np.array(Image.open(path))
        picture[40:, 20:40] = WOOD
        Image.fromarray(picture).save(path)
    atlas = {"pixels": pixels, "ramp": ["learnt", "gas"], "trim": "none"}
    built = build(tmp_path, source=source, atlas=atlas, **PLAIN)
    learnt, gas = np.asarray(Image.open(built.with_name("fire.ramp.png"))).astype(int)
    colours = frames_of(built)
    stick = colours[0][45:60, 25:35].reshape(-1, 4).astype(int)
    off = np.abs(stick - WOOD)
    # Thin flames of its brightness hide less: the ramp has one cover for both.
    assert off[:, :3].max() <= 12 and off[:, 3].max() <= 26, "one axis holds it about so"
    entry = int(np.argmin(np.abs(learnt - stick[0]).sum(axis=1)))
    assert np.abs(gas[entry] - learnt[entry])[:3].max() <= 12
    # A ramp's cover climbs by 6 an entry at most, from that of thin fire to that of wood.
    assert gas[entry, 3] > learnt[entry, 3] - 36, "it was glass"
    assert gas[-1, 2] >= gas[-1, 0] and gas[200, 2] > gas[200, 0] + 40, "the flame is blue"


def test_smoke_stays_smoke_in_pages_of_heat(tmp_path: Path) -> None:
    atlas = {"pixels": "heat", "ramp": ["learnt", "gas"]}
    built = build(tmp_path, source=sample("explosion"), atlas=atlas, **PLAIN)
    learnt, gas = np.asarray(Image.open(built.with_name("fire.ramp.png"))).astype(int)
    is_smoke = (learnt[:, 3] > 100) & (learnt[:, 0] < 60)
    assert np.count_nonzero(is_smoke) > 10
    assert np.abs(gas - learnt)[is_smoke].max() <= 12
