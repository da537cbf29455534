"""Atlases of others, by their JSON: frames come back as they were before they were packed."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from fire_atlas.core.errors import SourceError
from fire_atlas.sources import json_atlas
from fire_atlas.sources.json_atlas import atlas_files, describes, read_animation
from fire_atlas.sources.json_atlas_frames import open_atlas
from fire_atlas.sources.listing import ALL_FRAMES, list_inputs
from fire_atlas.sources.reader import FrameReader
from tests.support import synthetic_fire as fire
from tests.support.synthetic_fire import Rgba

Json = dict[str, Any]

WEB = Path(__file__).parents[1] / "formats" / "web"


def pack(frames: list[Rgba], *, rotate: bool = False, trim: bool = True) -> tuple[Rgba, list[Json]]:
    """Put frames beside each other as TexturePacker does; return the page and their entries."""
    entries, parts, x = list[Json](), [], 1
    for i, frame in enumerate(frames):
        rows, columns = (np.flatnonzero(frame[..., 3].any(axis=axis)) for axis in (1, 0))
        top, left, bottom, right = 0, 0, *frame.shape[:2]
        if trim:
            top, bottom, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
        part = frame[top:bottom, left:right]
        turned = rotate and i % 2 == 0
        stored = np.rot90(part, -1) if turned else part  # clockwise
        size = {"w": int(right - left), "h": int(bottom - top)}
        entries.append(
            {
                "filename": f"fire{i}.png",
                "frame": {"x": x, "y": 2, **size},
                "rotated": turned,
                "trimmed": trim,
                "spriteSourceSize": {"x": int(left), "y": int(top), **size},
                "sourceSize": {"w": frame.shape[1], "h": frame.shape[0]},
            }
        )
        parts.append((x, stored))
        x += stored.shape[1] + 1
    page = np.zeros((max(part.shape[0] for _, part in parts) + 3, x, 4), np.uint8)
    for at, part in parts:
        page[2 : 2 + part.shape[0], at : at + part.shape[1]] = part
    return page, entries


def trimmable(count: int = 6) -> list[Rgba]:
    """Frames with clear borders, each of its own; what is clear is black, as a packer leaves it."""
    frames = [np.zeros((30, 24, 4), np.uint8) for _ in range(count)]
    for i, frame in enumerate(frames):
        noise = np.random.default_rng(i).integers(1, 256, (11 + i, 7, 4), np.uint8)
        frame[3 + i : 14 + 2 * i, 5:12] = noise
    return frames


def write(path: Path, page: Rgba, frames: Any, **keys: Any) -> Path:
    """Write an atlas of one page; ``meta`` among ``keys`` is added to the usual one."""
    image = path.with_suffix(".png")
    Image.fromarray(page).save(image)
    size = {"w": page.shape[1], "h": page.shape[0]}
    meta = {"image": image.name, "size": size, "scale": "1", **keys.pop("meta", {})}
    path.write_text(json.dumps({"frames": frames, **keys, "meta": meta}), encoding="utf-8")
    return path


def as_hash(entries: list[Json]) -> Json:
    return {
        entry["filename"]: {key: value for key, value in entry.items() if key != "filename"}
        for entry in entries
    }


def simple(path: Path, count: int = 4, **keys: Any) -> Path:
    """Write an atlas whose frame i is filled with the value 10 (i + 1)."""
    frames = [np.full((4, 6, 4), 10 * (i + 1), np.uint8) for i in range(count)]
    page, entries = pack(frames)
    return write(path, page, entries, **keys)


def shown(reader: FrameReader) -> list[int]:
    """Return which of the frames of ``simple`` each tick shows."""
    return [int(reader.read(i)[0, 0, 0]) // 10 - 1 for i in range(reader.count)]


@pytest.mark.parametrize("layout", [list, as_hash])
@pytest.mark.parametrize("trim", [True, False])
@pytest.mark.parametrize("rotate", [True, False])
def test_turned_and_trimmed_frames_are_put_back_bit_for_bit(
    rotate: bool, trim: bool, layout: Callable[[list[Json]], Any], tmp_path: Path
) -> None:
    frames = trimmable()
    page, entries = pack(frames, rotate=rotate, trim=trim)
    reader = open_atlas(write(tmp_path / "a.json", page, layout(entries)), None, None)
    assert (reader.width, reader.height, reader.count, reader.fps) == (24, 30, 6, None)
    for i, frame in enumerate(frames):
        np.testing.assert_array_equal(reader.read(i), frame)


@given(st.data())
def test_any_part_of_any_frame_comes_back(data: st.DataObject) -> None:
    import tempfile

    frames = trimmable(data.draw(st.integers(1, 5)))
    for frame in frames:
        rows, columns = data.draw(st.integers(1, 30)), data.draw(st.integers(1, 24))
        frame[rows:] = 0
        frame[:, columns:] = 0
        frame[rows - 1, columns - 1] = 9
    page, entries = pack(frames, rotate=data.draw(st.booleans()))
    with tempfile.TemporaryDirectory() as folder:
        reader = open_atlas(write(Path(folder) / "a.json", page, entries), None, None)
        for i in data.draw(st.permutations(range(len(frames)))):
            np.testing.assert_array_equal(reader.read(i), frames[i])


@pytest.mark.parametrize("layout", [list, as_hash])
def test_frames_play_in_the_natural_order_of_their_names(
    layout: Callable[[list[Json]], Any], tmp_path: Path
) -> None:
    page, entries = pack([np.full((4, 6, 4), 10 * (i + 1), np.uint8) for i in range(12)])
    mixed = layout([entries[i] for i in np.random.default_rng(0).permutation(12)])
    assert shown(open_atlas(write(tmp_path / "a.json", page, mixed), None, None)) == [*range(12)]


def test_aliases_are_frames_of_their_own(tmp_path: Path) -> None:
    page, entries = pack([np.full((4, 6, 4), 10 * (i + 1), np.uint8) for i in range(2)])
    entries += [{**entries[0], "filename": "fire7.png"}]
    assert shown(open_atlas(write(tmp_path / "a.json", page, entries), None, None)) == [0, 1, 0]


def test_what_a_json_leaves_out_is_not_trimmed(tmp_path: Path) -> None:
    page, entries = pack(fire.fires(2), trim=False)
    plain = {entry["filename"]: {"frame": entry["frame"]} for entry in entries}
    reader = open_atlas(write(tmp_path / "a.json", page, plain, meta={"size": None}), None, None)
    np.testing.assert_array_equal(reader.read(1), fire.fires(2)[1])


def test_a_page_without_alpha_is_black_around_its_frames(tmp_path: Path) -> None:
    page, entries = pack(trimmable(2))
    path = write(tmp_path / "a.json", page, entries)
    Image.fromarray(page[..., :3]).save(tmp_path / "a.png")
    frame = open_atlas(path, None, None).read(0)
    np.testing.assert_array_equal(frame, trimmable(1)[0][..., :3])


TAGS = {
    "forward": ({"direction": "forward"}, [1, 2, 3]),
    "no direction": ({}, [1, 2, 3]),
    "reverse": ({"direction": "reverse"}, [3, 2, 1]),
    "pingpong": ({"direction": "pingpong"}, [1, 2, 3, 2]),
    "pingpong_reverse": ({"direction": "pingpong_reverse"}, [3, 2, 1, 2]),
    "once": ({"direction": "forward", "repeat": "1"}, [1, 2, 3]),
    "twice": ({"direction": "reverse", "repeat": "2"}, [3, 2, 1, 3, 2, 1]),
    "there": ({"direction": "pingpong", "repeat": "1"}, [1, 2, 3]),
    "there and back": ({"direction": "pingpong", "repeat": "2"}, [1, 2, 3, 2, 1]),
    "and there": ({"direction": "pingpong", "repeat": "3"}, [1, 2, 3, 2, 1, 2, 3]),
}


@pytest.mark.parametrize("tag", TAGS)
def test_a_tag_of_aseprite_plays_in_its_direction(tag: str, tmp_path: Path) -> None:
    keys, played = TAGS[tag]
    tags = [{"name": "burn", "from": 1, "to": 3, **keys}, {"name": "die", "from": 4, "to": 4}]
    path = simple(tmp_path / "a.json", 5, meta={"frameTags": tags})
    assert shown(open_atlas(path, "burn", None)) == played
    assert shown(open_atlas(path, "die", None)) == [4]


@pytest.mark.parametrize("direction", ["pingpong", "pingpong_reverse"])
def test_a_tag_of_one_frame_or_two_has_nothing_to_come_back_over(
    direction: str, tmp_path: Path
) -> None:
    tags = [
        {"name": "one", "from": 1, "to": 1, "direction": direction},
        {"name": "two", "from": 1, "to": 2, "direction": direction},
    ]
    path = simple(tmp_path / "a.json", meta={"frameTags": tags})
    assert shown(open_atlas(path, "one", None)) == [1]
    assert sorted(shown(open_atlas(path, "two", None))) == [1, 2]


def test_animations_of_pixi_play_the_frames_that_they_list(tmp_path: Path) -> None:
    animations = {"burn": ["fire2.png", "fire0.png", "fire2.png"]}
    reader = open_atlas(simple(tmp_path / "a.json", animations=animations), None, None)
    assert shown(reader) == [2, 0, 2]
    assert reader.notes == ("2 of its 4 frames are left out: 'burn' does not play them",)


def test_durations_become_ticks_at_a_constant_rate(tmp_path: Path) -> None:
    page, entries = pack([np.full((4, 6, 4), 10 * (i + 1), np.uint8) for i in range(3)])
    for entry, duration in zip(entries, (100, 900, 100), strict=True):
        entry["duration"] = duration
    path = write(tmp_path / "a.json", page, entries)
    reader = open_atlas(path, None, None)
    assert (reader.fps, shown(reader)) == (10, [0, *9 * [1], 2])
    reader = open_atlas(path, None, 20)
    assert (reader.fps, shown(reader)) == (20, [0, 0, *18 * [1], 2, 2])


def test_without_durations_each_frame_is_shown_once(tmp_path: Path) -> None:
    path = simple(tmp_path / "a.json")
    assert fire.open_clip(path).fps == 24
    assert fire.open_clip(path, fps=12).fps == 12
    assert fire.open_clip(path, fps=12, start=1, count=2).count == 2


@pytest.mark.parametrize("related", [True, False])
def test_an_animation_runs_over_several_pages(related: bool, tmp_path: Path) -> None:
    frames = [np.full((4, 6, 4), 10 * (i + 1), np.uint8) for i in range(5)]
    packs = list[Json]()
    for number, chosen in enumerate(([0, 3], [1, 2, 4])):
        page, entries = pack([frames[i] for i in chosen])
        for entry, i in zip(entries, chosen, strict=True):
            entry["filename"] = f"fire{i}"
        Image.fromarray(page).save(tmp_path / f"a-{number}.png")
        packs.append({"image": f"a-{number}.png", "frames": entries})
    if related:
        for number, each in enumerate(packs):
            names = [entry["filename"] for entry in each["frames"]]
            meta = {"image": each["image"], "related_multi_packs": [f"a-{1 - number}.json"]}
            document = {"frames": each["frames"], "animations": {"burn": names}, "meta": meta}
            (tmp_path / f"a-{number}.json").write_text(json.dumps(document))
    else:
        (tmp_path / "a-0.json").write_text(json.dumps({"textures": packs}))
    path = tmp_path / "a-0.json"
    assert shown(open_atlas(path, None, None)) == [0, 1, 2, 3, 4]
    images = [tmp_path / "a-0.png", tmp_path / "a-1.png"]
    assert list(atlas_files(path)) == [path, *([tmp_path / "a-1.json"] if related else []), *images]
    assert list_inputs(ALL_FRAMES, path) == list(fire.open_clip(path).inputs)


@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_premultiplied_pages_of_this_tool_give_their_light(space: str, tmp_path: Path) -> None:
    straight = fire.fires(2)
    wanted = [fire.light(frame) for frame in straight]
    stored = list[Rgba]()
    for frame, light in zip(straight, wanted, strict=True):
        from fire_atlas.atlas.encode import encode_frame

        stored.append(encode_frame(light, "premultiplied", space))  # type: ignore[arg-type]
        stored[-1][..., 3] = frame[..., 3]
    page, entries = pack(stored, rotate=True)
    own = {"alpha": "premultiplied", "blendSpace": space, "fps": 30}
    reader = open_atlas(
        write(tmp_path / "a.json", page, entries, meta={"fireAtlas": own}), None, None
    )
    assert reader.fps == 30
    for i, light in enumerate(wanted):
        read = reader.read(i)
        np.testing.assert_allclose(read[..., 3], light[..., 3], atol=1e-6)
        # Both encodings round once: half a step of sRGB, whose slope is at most 2.3.
        np.testing.assert_allclose(read[..., :3], light[..., :3], atol=2.5 / 255)


@pytest.mark.parametrize(
    ("own", "message"),
    [
        ({"alpha": "additive", "blendSpace": "srgb"}, "build it with atlas.alpha: straight"),
        (
            {"alpha": "straight", "blendSpace": "srgb", "heat": {"pixels": "heat"}},
            "hold heat, not colours; build it with atlas.pixels: color",
        ),
    ],
)
def test_pages_without_coverage_or_colours_are_refused(
    own: Json, message: str, tmp_path: Path
) -> None:
    path = simple(tmp_path / "a.json", meta={"fireAtlas": own})
    with pytest.raises(SourceError, match=message):
        open_atlas(path, None, None)


def refused(tmp_path: Path, document: Any, message: str, animation: str | None = None) -> None:
    path = simple(tmp_path / "a.json")
    text = document if isinstance(document, str) else json.dumps(document)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SourceError, match=message) as caught:
        open_atlas(path, animation, None)
    assert str(path) in str(caught.value)


PLACE = {"x": 0, "y": 0, "w": 6, "h": 4}
META = {"image": "a.png"}

BROKEN: dict[str, tuple[Any, str]] = {
    "no JSON": ('{"frames":\n [1,, 2]}', r"a.json: line 2, column 5: is not JSON"),
    "deeply nested": ("[" * 100_000, "is not JSON"),
    "not text": ("\ud800".encode("utf-16-le", "surrogatepass").decode("latin1"), "is not JSON"),
    "a list": ([], "describes no atlas"),
    "a profile": ({"format": "fire-atlas/profile"}, r"describes no atlas \(it is a file of fire-"),
    "no meta": ({"frames": {"f": {"frame": PLACE}}}, "image is missing"),
    "no frames": ({"frames": {}, "meta": META}, "describes 0 frames"),
    "frames of another type": ({"frames": 3, "meta": META}, "frames must be a block .* it is 3"),
    "no place": ({"frames": {"f": {}}, "meta": META}, "frame 'f': frame is missing"),
    "no height": (
        {"frames": {"f": {"frame": {"x": 0, "y": 0, "w": 6}}}, "meta": META},
        "frame 'f': frame.h is missing; it must be a number",
    ),
    "a length in words": (
        {"frames": {"f": {"frame": {**PLACE, "w": "6"}}}, "meta": META},
        "frame 'f': frame.w must be a number from 1 to 32768; it is '6'",
    ),
    "a switch for a length": (
        {"frames": {"f": {"frame": {**PLACE, "w": True}}}, "meta": META}, "frame.w must be",
    ),
    "half a pixel": (
        {"frames": {"f": {"frame": {**PLACE, "x": 0.5}}}, "meta": META}, "a whole number of px",
    ),
    "no number": (
        {"frames": {"f": {"frame": {**PLACE, "x": float("nan")}}}, "meta": META},
        "frame.x must be a number",
    ),
    "negative": ({"frames": {"f": {"frame": {**PLACE, "y": -1}}}, "meta": META}, "frame.y must be"),
    "outside of the image": (
        {"frames": {"f": {"frame": {**PLACE, "x": 4000}}}, "meta": META},
        r"frame 'f' is 6x4 px at \(4000, 0\), outside of a.png, which is 29x7",
    ),
    "turned, outside of the image": (
        {"frames": {"f": {"frame": {**PLACE, "w": 8}, "rotated": True}}, "meta": META},
        r"frame 'f' is 4x8 px",
    ),
    "trimmed to more": (
        {
            "frames": {"f": {"frame": PLACE, "sourceSize": {"w": 6, "h": 3}}},
            "meta": META,
        },
        r"its 6x4 px at \(0, 0\) \(spriteSourceSize\) do not lie within 6x3",
    ),
    "too large": (
        {"frames": {"f": {"frame": PLACE, "sourceSize": {"w": 30000, "h": 4}}}, "meta": META},
        "30000x4 is too large",
    ),
    "of several sizes": (
        {
            "frames": {
                "f": {"frame": PLACE},
                "g": {"frame": PLACE, "sourceSize": {"w": 8, "h": 9}},
            },
            "meta": META,
        },
        r"frame 'g' is 8x9 \(sourceSize\), but 'f' is 6x4",
    ),
    "some with a duration": (
        {"frames": {"f": {"frame": PLACE, "duration": 9}, "g": {"frame": PLACE}}, "meta": META},
        "frame 'g' has no duration",
    ),
    "an endless duration": (
        {"frames": {"f": {"frame": PLACE, "duration": 1e300}}, "meta": META},
        "frame 'f': duration must be a number from 1 to 600000",
    ),
    "no names": ({"frames": [{"frame": PLACE}], "meta": META}, r"frames\[0\].filename is missing"),
    "polygons": (
        {"frames": {"f": {"frame": PLACE, "vertices": []}}, "meta": META}, "packed as a polygon",
    ),
    "too many frames": (
        {"frames": {str(i): 0 for i in range(10_001)}, "meta": META}, "describes 10001 frames",
    ),
    "an unknown frame": (
        {"frames": {"f": {"frame": PLACE}}, "animations": {"a": ["g"]}, "meta": META},
        r"animations.a\[0\] is 'g', but no frame of the atlas is called so",
    ),
    "an ambiguous frame": (
        {
            "frames": [{"filename": "f", "frame": PLACE}] * 2,
            "animations": {"a": ["f"]},
            "meta": META,
        },
        "is 'f', but 2 frames of the atlas are called so",
    ),
    "an empty animation": (
        {"frames": {"f": {"frame": PLACE}}, "animations": {"a": []}, "meta": META},
        "animations.a must be a list of 1 to 10000 frames",
    ),
    "a tag beyond the frames": (
        {
            "frames": {"f": {"frame": PLACE}},
            "meta": {**META, "frameTags": [{"name": "t", "from": 0, "to": 1}]},
        },
        "tag 't' plays frames 0 to 1, but there are 1",
    ),
    "a tag that plays for ever": (
        {
            "frames": {"f": {"frame": PLACE}},
            "meta": {**META, "frameTags": [{"name": "t", "from": 0, "to": 0, "repeat": "99999"}]},
        },
        "tag 't' plays 1 frames 99999 times; at most 10000",
    ),
    "a tag in another direction": (
        {
            "frames": {"f": {"frame": PLACE}},
            "meta": {**META, "frameTags": [{"name": "t", "from": 0, "to": 0, "direction": "up"}]},
        },
        r"meta.frameTags\[0\].direction must be one of forward, reverse",
    ),
    "two tags of one name": (
        {
            "frames": {"f": {"frame": PLACE}},
            "meta": {**META, "frameTags": [{"name": "t", "from": 0, "to": 0}] * 2},
        },
        "two tags are called 't'",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", BROKEN)
def test_a_json_that_cannot_be_is_refused(fault: str, tmp_path: Path) -> None:
    refused(tmp_path, *BROKEN[fault])


@pytest.mark.parametrize(
    "name",
    ["../a.png", "/etc/passwd", "C:a.png", "C:\\a.png", "x\\a.png", "x/../../a.png", "a\0.png",
     "\ud800.png", "..", ""],
)  # fmt: skip
@pytest.mark.parametrize("key", ["image", "related_multi_packs"])
def test_a_json_leads_to_no_other_folder(key: str, name: str, tmp_path: Path) -> None:
    meta = {"image": "a.png", key: name if key == "image" else [name]}
    frames = {"f": {"frame": PLACE}}
    refused(tmp_path, {"frames": frames, "meta": meta}, r"meta\.(image|related.*) must be")


@pytest.mark.parametrize("name", ["b.png", "b" * 900])
def test_a_missing_image_or_pack_is_refused(name: str, tmp_path: Path) -> None:
    frames, missing = {"f": {"frame": PLACE}}, f"is '{name}', but there is no such file beside it"
    refused(tmp_path, {"frames": frames, "meta": {"image": name}}, f"meta.image {missing}")
    meta = {**META, "related_multi_packs": [name]}
    refused(tmp_path, {"frames": frames, "meta": meta}, rf"packs\[0\] {missing}")


def test_a_json_that_is_too_large_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(json_atlas, "MAX_JSON_BYTES", 100)
    with pytest.raises(SourceError, match="is larger than"):
        atlas_files(simple(tmp_path / "a.json"))


def test_one_of_several_animations_must_be_named(tmp_path: Path) -> None:
    animations = {"burn": ["fire0.png"], "die": ["fire1.png", "fire2.png"]}
    path = simple(tmp_path / "a.json", animations=animations)
    assert shown(open_atlas(path, "die", None)) == [1, 2]
    with pytest.raises(
        SourceError, match=r"animation: .*holds 2 animations; name one of them: burn, die"
    ):
        open_atlas(path, None, None)
    with pytest.raises(SourceError, match=r"no animation 'burns'; did you mean burn\?.* burn, die"):
        open_atlas(path, "burns", None)
    with pytest.raises(SourceError, match="names no animations; leave it out"):
        open_atlas(simple(tmp_path / "b.json"), "burn", None)


def test_settings_that_do_not_fit_a_json_are_refused(tmp_path: Path) -> None:
    path = simple(tmp_path / "a.json")
    with pytest.raises(
        SourceError, match=r"cuts one still image into cells, which .*a\.json is not"
    ):
        fire.open_clip(path, grid={"columns": 2, "rows": 1})
    with pytest.raises(SourceError, match="is JSON; leave it out"):
        fire.open_clip(path, layer="rgba")
    folder = fire.write_folder(tmp_path / "f", fire.fires())
    for other in (path.with_suffix(".png"), folder):
        with pytest.raises(SourceError, match="is no JSON; give that as path, or leave"):
            fire.open_clip(other, animation="burn")


def test_a_page_that_was_scaled_and_pivots_that_move_are_noted(tmp_path: Path) -> None:
    page, entries = pack(trimmable(2))
    for i, entry in enumerate(entries):
        entry["anchor"] = {"x": 0.5, "y": i / 2}
    path = write(tmp_path / "a.json", page, entries, meta={"size": {"w": 8, "h": 9}})
    pivots, size = open_atlas(path, None, None).notes
    assert pivots == "its frames have different anchors, which move nothing here"
    assert size.startswith(f"a.png is {page.shape[1]}x{page.shape[0]} px, but its JSON says 8x9")


def test_an_image_is_described_by_the_json_that_names_it(tmp_path: Path) -> None:
    path = simple(tmp_path / "a.json")
    assert describes(path, tmp_path / "a.png")
    assert not describes(path, tmp_path / "b.png")
    assert not describes(tmp_path / "b.json", tmp_path / "a.png")
    path.write_text("{")
    assert not describes(path, tmp_path / "a.png")


@given(st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(
        st.sampled_from(["frames", "meta", "textures", "frame", "x", "image", "animations", "size",
                         "anims", "frameTags", "fireAtlas", "related_multi_packs", "key"]),
        inner, max_size=5),
    max_leaves=30,
))  # fmt: skip
def test_whatever_a_json_holds_is_read_or_refused(document: Any) -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.json"
        path.write_text(json.dumps(document))
        with pytest.raises(SourceError):
            read_animation(path, None)


@pytest.mark.engine
@pytest.mark.parametrize("rotate", [True, False])
@pytest.mark.parametrize("trim", [True, False])
def test_frames_lie_where_pixi_finds_them(
    trim: bool, rotate: bool, node: str, tmp_path: Path
) -> None:
    page, entries = pack(trimmable(), rotate=rotate, trim=trim)
    for entry in entries:
        entry["anchor"] = {"x": 0.5, "y": 0.9}
    animations = {"burn": [f"fire{i}.png" for i in (4, 1, 4, 0)]}
    path = write(tmp_path / "a.json", page, as_hash(entries), animations=animations)
    ran = subprocess.run(
        [node, WEB / "parse.mjs", path],
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=True,
    )
    (seen,) = json.loads(ran.stdout)["pixi"]
    played = read_animation(path, "burn").frames
    assert [frame.name for frame in played] == seen["animations"]["burn"]
    for frame in played:
        width, height = frame.width, frame.height
        found = seen["frames"][frame.name]
        stored = [height, width] if frame.rotated else [width, height]
        assert found["frame"] == [frame.x, frame.y, *stored]
        assert found["size"] == [frame.full_width, frame.full_height]
        assert found["trim"] == ([frame.trim_x, frame.trim_y, width, height] if trim else None)
