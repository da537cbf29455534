"""Which picture of an EXR file with layers and parts is read, and what is said about it."""

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture
from fire_atlas.sources.images import decode, read_header
from tests.support import synthetic_fire as fire

SIZE = (6, 5)


def plane(seed: int) -> Any:
    return np.random.default_rng(seed).random(SIZE).astype(np.float16)


def layer(name: str, seed: int, channels: str = "RGB") -> dict[str, Any]:
    """Channels of a layer, whose first plane has the seed, the next one the seed + 1, and so on."""
    dot = f"{name}." if name else ""
    return {f"{dot}{channel}": plane(seed + i) for i, channel in enumerate(channels)}


def colours(seed: int, count: int = 3) -> Picture:
    return np.dstack([plane(seed + i) for i in range(count)]).astype(np.float32)


def written(path: Path, *layers: dict[str, Any]) -> Path:
    OpenEXR.File({}, {name: pixels for each in layers for name, pixels in each.items()}).write(
        str(path)
    )
    return path


def written_parts(path: Path, **parts: dict[str, Any]) -> Path:
    OpenEXR.File([OpenEXR.Part({}, channels, name) for name, channels in parts.items()]).write(
        str(path)
    )
    return path


def decoded(path: Path, layer: str | None = None) -> Picture:
    return decode(path, read_header(path, layer=layer))


def notes(path: Path) -> str:
    return " ".join(read_header(path).notes)


def refusal(path: Path, layer: str | None = None) -> str:
    with pytest.raises(SourceError) as caught:
        read_header(path, layer=layer)
    assert str(path) in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", ["ViewLayer.Combined", "C", "rgba", "anything.at.all"])
def test_the_only_layer_with_colours_is_read_without_a_word(name: str, tmp_path: Path) -> None:
    path = written(tmp_path / "a.exr", layer(name, 1, "RGBA"), layer("Depth", 9, "Z"))
    np.testing.assert_array_equal(decoded(path), colours(1, 4))
    assert notes(path) == ""


@pytest.mark.parametrize(
    "names", [("red", "green", "blue"), ("r", "g", "b"), ("Red", "Green", "BLUE")]
)
def test_names_of_channels_are_read_in_words_and_in_any_case(
    names: tuple[str, str, str], tmp_path: Path
) -> None:
    channels = {f"beauty.{name}": plane(1 + i) for i, name in enumerate(names)}
    np.testing.assert_array_equal(decoded(written(tmp_path / "a.exr", channels)), colours(1))


def test_colours_without_a_layer_come_first_and_a_note_names_the_others(tmp_path: Path) -> None:
    path = written(tmp_path / "a.exr", layer("diffuse", 1), layer("", 5), layer("glow", 9))
    np.testing.assert_array_equal(decoded(path), colours(5))
    assert "layer without a name (R, G, B) is used" in notes(path)
    assert "source.layer can choose diffuse, glow" in notes(path)


@pytest.mark.parametrize("name", ["ViewLayer.Combined", "out.RGBA", "C", "beauty", "a.b.color"])
def test_of_several_layers_the_finished_picture_is_known_by_its_name(
    name: str, tmp_path: Path
) -> None:
    path = written(tmp_path / "a.exr", layer("ViewLayer.DiffCol", 5), layer(name, 1))
    np.testing.assert_array_equal(decoded(path), colours(1))
    assert notes(path) == f"its layer {name} is used; source.layer can choose ViewLayer.DiffCol"


def test_layers_of_which_none_is_plainly_finished_are_listed_and_one_is_proposed(
    tmp_path: Path,
) -> None:
    path = written(tmp_path / "a.exr", layer("diffuse", 1), layer("glow", 5))
    assert "source.layer: diffuse, of diffuse, glow" in refusal(path)
    two = written(tmp_path / "b.exr", layer("Other.Mist", 3), layer("A.Combined", 1),
                  layer("B.Combined", 5))  # fmt: skip
    assert "source.layer: A.Combined, of" in refusal(two)


def test_a_layer_is_chosen_by_its_name_in_any_case(tmp_path: Path) -> None:
    path = written(tmp_path / "a.exr", layer("", 1), layer("Glow", 5, "RGBA"))
    np.testing.assert_array_equal(decoded(path, "Glow"), colours(5, 4))
    np.testing.assert_array_equal(decoded(path, "glow"), colours(5, 4))
    assert read_header(path, layer="Glow").notes == ()


def test_an_unknown_layer_is_refused_with_those_there_are(tmp_path: Path) -> None:
    path = written(
        tmp_path / "a.exr", layer("diffuse", 1), layer("glow", 5), layer("Depth", 9, "Z")
    )
    message = refusal(path, "glwo")
    assert "'glwo' is none of its layers; it has diffuse, glow; did you mean glow?" in message
    assert "'Depth' has no colours, only Z; it has diffuse, glow" in refusal(path, "Depth")
    plain = written(tmp_path / "b.exr", layer("", 1))
    assert "'glow' is none of its layers; it has no layers with names" in refusal(plain, "glow")


def test_normals_are_no_grey(tmp_path: Path) -> None:
    path = written(tmp_path / "a.exr", layer("Normal", 1, "XYZ"), layer("key", 5, "Y"))
    np.testing.assert_array_equal(decoded(path), np.dstack([plane(5)] * 3))
    assert "holds no channels R, G and B, nor Y" in refusal(
        written(tmp_path / "b.exr", layer("Normal", 1, "XYZ"))
    )


def test_alpha_is_that_of_the_same_layer(tmp_path: Path) -> None:
    path = written(tmp_path / "a.exr", layer("", 1), layer("glow", 5, "A"))
    np.testing.assert_array_equal(decoded(path), colours(1))


def test_parts_are_layers_too(tmp_path: Path) -> None:
    path = written_parts(
        tmp_path / "a.exr", depth=layer("", 9, "Z"), rgba=layer("", 1, "RGBA"), glow=layer("", 5)
    )
    np.testing.assert_array_equal(decoded(path), colours(1, 4))
    assert notes(path) == "its layer rgba is used; source.layer can choose glow"
    np.testing.assert_array_equal(decoded(path, "glow"), colours(5))
    assert "'depth' has no colours, only Z; it has rgba, glow" in refusal(path, "depth")


def test_a_layer_that_repeats_the_name_of_its_part_is_named_once(tmp_path: Path) -> None:
    path = written_parts(
        tmp_path / "a.exr",
        glow=layer("glow", 1),
        smoke=layer("smoke.thin", 5),
        embers=layer("near", 9),
    )
    assert "of glow, smoke.thin, embers.near" in refusal(path)
    np.testing.assert_array_equal(decoded(path, "embers.near"), colours(9))
    np.testing.assert_array_equal(decoded(path, "embers"), colours(9))
    np.testing.assert_array_equal(decoded(path, "smoke"), colours(5))


def test_of_two_cameras_the_first_is_seen(tmp_path: Path) -> None:
    parts = [
        OpenEXR.Part({"view": "left"}, layer("", 1), "left"),
        OpenEXR.Part({"view": "right"}, layer("", 5), "right"),
    ]
    OpenEXR.File(parts).write(str(tmp_path / "a.exr"))
    np.testing.assert_array_equal(decoded(tmp_path / "a.exr"), colours(1))
    np.testing.assert_array_equal(decoded(tmp_path / "a.exr", "right"), colours(5))
    assert "layer left is used; source.layer can choose right" in notes(tmp_path / "a.exr")
    OpenEXR.File(
        {"multiView": ["left", "right"]}, {**layer("", 1), **layer("right", 5)}
    ).write(str(tmp_path / "b.exr"))  # fmt: skip
    np.testing.assert_array_equal(decoded(tmp_path / "b.exr"), colours(1))
    np.testing.assert_array_equal(decoded(tmp_path / "b.exr", "right"), colours(5))


def deep_plane() -> Any:
    samples = np.empty(SIZE, dtype=object)
    for place in np.ndindex(SIZE):
        samples[place] = np.arange(1 + place[0], dtype=np.float32)
    return samples


DEEP = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}


def test_deep_images_are_refused_as_such(tmp_path: Path) -> None:
    OpenEXR.File(DEEP, {name: deep_plane() for name in "RGB"}).write(str(tmp_path / "a.exr"))
    assert "the image is deep" in refusal(tmp_path / "a.exr")
    cloud = OpenEXR.Part(DEEP, {name: deep_plane() for name in "RGB"}, "cloud")
    OpenEXR.File([cloud, OpenEXR.Part({}, layer("", 1), "flat")]).write(str(tmp_path / "b.exr"))
    assert "its layer cloud is deep" in refusal(tmp_path / "b.exr", "cloud")
    np.testing.assert_array_equal(decoded(tmp_path / "b.exr"), colours(1))


def test_a_sequence_has_the_layer_in_every_frame(tmp_path: Path) -> None:
    for i in range(3):
        written(tmp_path / f"f{i}.exr", layer("", 1), layer("glow", 5 + i, "RGBA"))
    clip = fire.open_clip(tmp_path, layer="glow")
    np.testing.assert_array_equal(clip.read(2), colours(7, 4))
    written(tmp_path / "f1.exr", layer("", 1))
    with pytest.raises(SourceError, match=r"f1\.exr.*'glow' is none of its layers"):
        fire.open_clip(tmp_path, layer="glow")


def test_a_note_on_all_frames_is_given_once_and_one_on_a_few_names_them(tmp_path: Path) -> None:
    for i in range(4):
        written(tmp_path / f"f{i}.exr", layer("", 1), layer("glow", 5))
    said = "layer without a name (R, G, B) is used; source.layer can choose glow"
    assert fire.open_clip(tmp_path).notes == (f"its {said}",)
    written(tmp_path / "f1.exr", layer("", 1))
    assert fire.open_clip(tmp_path).notes == (f"f0.exr and 2 more: its {said}",)


@pytest.mark.parametrize("ending", ["png", "gif", "webp", "jpg", "mp4"])
def test_layers_of_other_formats_are_refused(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{ending}"
    if ending == "mp4":
        fire.write_video(path, fire.fires(3), "libx264", "yuv420p")
    else:
        fire.images(fire.fires(1))[0].convert("RGB").save(path)
    with pytest.raises(SourceError, match=rf"names a layer of EXR files, but .*a\.{ending} is "):
        fire.open_clip(path, layer="glow")


def test_the_cells_of_a_sheet_are_cut_from_a_layer(tmp_path: Path) -> None:
    path = written(tmp_path / "a.exr", layer("", 1), layer("glow", 5, "RGBA"))
    clip = fire.open_clip(path, layer="glow", grid={"columns": 1, "rows": 2})
    np.testing.assert_array_equal(clip.read(1), colours(5, 4)[3:])
