"""Whole builds with maps: files, formulas, layers, and what is refused."""

import contextlib
import io
import json
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import decode_bytes
from fire_atlas.core.shipped import shipped
from tests.support.clips import SAMPLES, real
from tests.support.flipbook import ENGINES, plain, read_flipbook
from tests.support.requirements import real_clips

GRID: dict[str, Any] = {"layout": "grid", "alpha": "premultiplied"}
RIGHT_AND_WRONG = (1, 1), (1, -1), (-1, 1), (-1, -1)


def build(folder: Path, *args: str, code: int = 0, name: str = "fire", **keys: Any) -> Path:
    """Build a small part of the sample campfire."""
    source = {"path": str(shipped("samples") / "campfire"), "fps": 24, "count": 12, "height": 96}
    recipe = folder / f"{name}.yaml"
    folder.mkdir(parents=True, exist_ok=True)
    recipe.write_text(json.dumps({"source": source, "tracks": [], **keys}), encoding="utf-8")
    with contextlib.redirect_stderr(io.StringIO()) as said:
        assert main(["build", "-q", str(recipe), *args]) == code, said.getvalue()
    (folder / "said.txt").write_text(said.getvalue(), encoding="utf-8")
    return folder / "build"


def test_data_states_no_colour_space_and_colours_do(tmp_path: Path) -> None:
    keys: dict[str, Any] = {"motion": "godot", "haze": True, "flame": True}
    for compression in "fast", "small":
        made = build(tmp_path, maps=keys, atlas={"compression": compression})
        stated = {path.name: b"sRGB" in path.read_bytes()[:64] for path in made.glob("*.png")}
        assert stated == {
            "fire.png": True, "fire.flame.png": True, "fire.motion.png": False,
            "fire.haze.png": False,
        }  # fmt: skip


def refused(folder: Path, **keys: Any) -> str:
    build(folder, code=2, **keys)
    return (folder / "said.txt").read_text(encoding="utf-8")


def rgba(path: Path) -> np.ndarray[Any, np.dtype[np.uint8]]:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGBA"))


def meta(build: Path, file: str = "fire.json") -> dict[str, Any]:
    found: dict[str, Any] = json.loads((build / file).read_text(encoding="utf-8"))["meta"]
    return found


@pytest.fixture(scope="module")
def books(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return {
        engine: build(
            tmp_path_factory.mktemp(engine), maps={"motion": engine}, atlas=GRID, flakes="none",
            timeline={"loop": "none"},
        )
        for engine in ENGINES
    }  # fmt: skip


def test_three_engines_show_the_same_between_two_frames(books: dict[str, Path]) -> None:
    shown = {
        e: play(read_flipbook(books[e], "fire"), 4, 0.4, (1, 1)) for e, play in ENGINES.items()
    }
    moved = np.abs(shown["unity"] - plain(read_flipbook(books["unity"], "fire"), 4, 0.4))
    assert moved.max() > 20, "vectors do something"
    for engine in ("unreal", "godot"):
        off = np.abs(shown[engine] - shown["unity"])
        assert off.max() < 6 and off.mean() < 0.1  # half a byte of a vector, on sharp edges


@pytest.mark.parametrize("engine", ENGINES)
def test_at_its_own_time_a_frame_is_itself(books: dict[str, Path], engine: str) -> None:
    book = read_flipbook(books[engine], "fire")
    assert ENGINES[engine](book, 3, 0.0, (1, 1)) == pytest.approx(plain(book, 3, 0.0), abs=1e-6)
    assert ENGINES[engine](book, 3, 1.0, (1, 1)) == pytest.approx(plain(book, 4, 0.0), abs=1e-6)


@pytest.mark.parametrize("engine", ENGINES)
def test_no_sample_leaves_its_cell(books: dict[str, Path], engine: str) -> None:
    """Cells differ by their colour: no other's is ever seen, whatever the time."""
    book = read_flipbook(books[engine], "fire")
    x, y, width, height = book.box
    for number, (page, column, row) in enumerate(book.places):
        left, top = column * book.cell[0], row * book.cell[1]
        cell = book.pages[page][top : top + book.cell[1], left : left + book.cell[0]]
        cell[:] = 0
        cell[y : y + height, x : x + width] = (
            (200, 0, 0, 255) if number in (4, 5) else (0, 200, 0, 0)
        )
    for blend in (0.0, 0.3, 0.5, 1.0):
        seen = book.frame_part(ENGINES[engine](book, 4, blend, (1, 1)))
        assert seen[..., 1].max() < 1 and seen[..., 0].min() > 199 - 1


@pytest.mark.parametrize("engine", ENGINES)
def test_what_plays_once_ends_without_motion(books: dict[str, Path], engine: str) -> None:
    book = read_flipbook(books[engine], "fire")
    assert not book.loop
    page, column, row = book.places[-1]
    width, height = book.cell
    last = book.motion[page][
        row * height : (row + 1) * height, column * width : (column + 1) * width
    ]
    assert (last == (128, 128, 0, 255)).all()


@pytest.mark.parametrize(
    ("engine", "red", "green", "unit"),
    [("unity", "right", "up", "cell"), ("unreal", "right", "down", "cell"),
     ("godot", "right", "down", "pixel")],
)  # fmt: skip
def test_the_json_says_how_to_read_them(
    books: dict[str, Path], engine: str, red: str, green: str, unit: str
) -> None:
    entry = meta(books[engine])
    (motion,) = entry["maps"]
    assert motion["image"] == "fire.motion.png"
    assert (motion["engine"], motion["red"], motion["green"]) == (engine, red, green)
    assert motion["srgb"] is False and motion["neutral"] == 128 and motion["unit"] == unit
    grid, strength = entry["fireAtlas"]["grid"], motion["strength"]
    cell = grid["cellWidth"], grid["cellHeight"]
    for axis in (0, 1):
        uv = strength["pixels"][axis] / cell[axis]
        assert strength["cellUv"][axis] == pytest.approx(uv, rel=1e-5)
        assert strength["cellUvPerSecond"][axis] == pytest.approx(24 * uv, rel=1e-5)
        assert motion["reach"][axis] <= strength["pixels"][axis] + 1e-6
    own = strength["cellUv"] if unit == "cell" else strength["pixels"]
    assert own == [motion["scale"]] * 2
    assert math.isclose(motion["scale"], float(f"{motion['scale']:.4g}"), rel_tol=1e-9), "to copy"


def test_inspect_and_templates_know_them(
    books: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    atlas = str(books["unity"] / "fire.json")
    assert main(["inspect", atlas]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "% closer than plain blending" in said
    assert main(["inspect", "--context", atlas]) == 0
    context = json.loads(capsys.readouterr().out)
    assert context["pages"][0]["maps"] == {"motion": "fire.motion.png"}
    assert context["motion"]["scale"] == meta(books["unity"])["maps"][0]["scale"]
    assert context["motion"]["green"] == "up"


def test_inspect_says_in_words_that_nothing_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = Image.open(next((shipped("samples") / "campfire").glob("*.png"))).convert("RGBA")
    clip = tmp_path / "clip"
    clip.mkdir()
    for i in range(9):
        frame.resize((64, 80)).save(clip / f"{i}.png")
    out = build(tmp_path, source={"path": str(clip)}, maps={"motion": "unity"}, atlas=GRID)
    vectors = np.asarray(Image.open(out / "fire.motion.png"))[..., :2]
    assert vectors.min() == vectors.max() == 128
    assert main(["inspect", str(out / "fire.json")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "motion vectors: none, nothing moves: frames that were held out are as their" in said
    assert "closer" not in said


FIGURES = {
    "held_out": 8, "written": True, "gain": 0.3149, "method": "dis",
    "residual": {"blend": 4.0, "dis": 2.7404, "farneback": 2.9}, "fewer_frames": {},
}  # fmt: skip


@pytest.mark.parametrize(
    ("statistics", "sentences"),
    [
        (
            {"motion": FIGURES},
            "motion vectors: 31 % closer than plain blending",
        ),
        (
            {"motion": {**FIGURES, "gain": 0.01}},
            "motion vectors: 1 % closer than plain blending",
        ),
        (
            {"motion": {**FIGURES, "gain": 0.004}},
            "motion vectors: less than 1 % closer than plain blending; little of what changes "
            "between frames is motion",
        ),
        (
            {"members": {"a": {"animations": {"left": {"motion": {**FIGURES, "written": False}}}},
                         "b": {"animations": 1, "motions": {"run": {"motion": None}}}}},
            "motion vectors of a/left: none, plain blending is as close to frames that were held "
            "out motion vectors of b/run: none, the animation is too short to test them",
        ),
    ],
)  # fmt: skip
def test_inspect_says_what_the_build_found_out_about_vectors(
    books: dict[str, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    statistics: dict[str, Any],
    sentences: str,
) -> None:
    out = shutil.copytree(books["unity"], tmp_path / "build")
    manifest = out / "fire.manifest.json"
    document = json.loads(manifest.read_text(encoding="utf-8"))
    manifest.write_text(json.dumps({**document, "statistics": statistics}), encoding="utf-8")
    assert main(["inspect", str(out / "fire.json"), "--maps"]) == 0
    assert sentences in " ".join(capsys.readouterr().out.split())
    manifest.unlink()
    assert main(["inspect", str(out / "fire.json")]) == 0
    assert "motion vectors" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "JSONDecodeError: Expecting property name"),
        ("{}", "ValueError: a key is missing"),
        ('{"statistics": {"motion": {}}}', "ValueError: {} are no figures of motion vectors"),
        ('{"statistics": {"members": {"a": 1}}}', "ValueError: 1 are no statistics"),
    ],
)
def test_inspect_refuses_a_broken_manifest(
    books: dict[str, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    text: str,
    reason: str,
) -> None:
    out = shutil.copytree(books["unity"], tmp_path / "build")
    manifest = out / "fire.manifest.json"
    if "statistics" in text:
        document = json.loads(manifest.read_text(encoding="utf-8"))
        text = json.dumps({**document, **json.loads(text)})
    manifest.write_text(text, encoding="utf-8")
    assert main(["inspect", str(out / "fire.json")]) == 1
    said = capsys.readouterr().err
    assert f"fire.manifest.json: is not a manifest that fire-atlas wrote ({reason}" in said
    assert "); build the recipe again" in said


def test_a_scale_has_the_same_motion_in_cells_and_half_of_it_in_pixels(tmp_path: Path) -> None:
    out = build(tmp_path, maps={"motion": "unity"}, atlas={**GRID, "scales": [1, 0.5]})
    whole, half = (meta(out, f"fire{at}.json")["maps"][0] for at in ("", "@0.5x"))
    assert half["image"] == "fire@0.5x.motion.png"
    assert half["strength"]["cellUv"] == whole["strength"]["cellUv"]
    assert half["strength"]["pixels"] == [p / 2 for p in whole["strength"]["pixels"]]
    one, two = (read_flipbook(out, name) for name in ("fire", "fire@0.5x"))
    large, small = (
        np.asarray(Image.fromarray(b.motion[0].astype(np.uint8)).resize(
            (two.motion[0].shape[1], two.motion[0].shape[0]), Image.Resampling.BOX
        ), np.float64) for b in (one, two)
    )  # fmt: skip
    assert np.abs(large - small)[..., :2].mean() < 1.5


def test_several_pages_loops_and_members_share_one_scale(tmp_path: Path) -> None:
    build(tmp_path, name="still", timeline={"loop": "none"})
    keys = {"members": ["still.yaml"], **GRID, "max_size": 200}
    out = build(tmp_path, name="fire", maps={"motion": "unreal", "flakes": True}, atlas=keys)
    pages = sorted(path.name for path in out.glob("fire*.motion.png"))
    assert len(pages) > 1 and pages[0] == "fire-1.motion.png" and pages[-1] == "fire.motion.png"
    assert len(list(out.glob("fire*.flakes.png"))) == len(pages)
    scales = set()
    for path in out.glob("fire*.json"):
        if "manifest" not in path.name:
            entry = meta(out, path.name)
            assert [m["kind"] for m in entry["maps"]] == ["motion", "flakes"]
            assert entry["maps"][0]["image"] == entry["image"].replace(".png", ".motion.png")
            assert rgba(out / entry["maps"][0]["image"]).shape == rgba(out / entry["image"]).shape
            scales.add(entry["maps"][0]["scale"])
    assert len(scales) == 1
    book = read_flipbook(out, "fire")
    assert not np.array_equal(ENGINES["unreal"](book, 2, 0.5, (1, 1)), plain(book, 2, 0.5))


def test_packed_frames_keep_room_for_their_motion(tmp_path: Path) -> None:
    """For clients that count in px of the frame: Godot's convention, each frame in its own box."""
    keys: dict[str, Any] = {"flakes": "none", "timeline": {"loop": "none"}}
    packed = build(tmp_path / "a", maps={"motion": "godot"}, **keys)
    bare = build(tmp_path / "b", **keys)
    motion = meta(packed)["maps"][0]
    assert motion["strength"]["cellUv"] is None and motion["gutter"] is None
    with_room, without = (
        json.loads((out / "fire.json").read_text())["frames"] for out in (packed, bare)
    )
    margin = math.ceil(max(motion["reach"]))
    for name, frame in without.items():
        cut, kept = frame["spriteSourceSize"], with_room[name]["spriteSourceSize"]
        assert kept["x"] <= max(cut["x"] - margin + 1, 0)
        assert kept["y"] <= max(cut["y"] - margin + 1, 0)


def test_flame_and_flakes_add_up_to_the_page(tmp_path: Path) -> None:
    """By the light that film saw of them, as ``composite.blend: add`` joins them."""
    out = build(
        tmp_path, maps={"flame": True, "flakes": True}, composite={"blend": "add"},
        atlas={"alpha": "premultiplied", "blend_space": "linear"}, flakes={"rate": 120},
    )  # fmt: skip
    page, flame, flakes = (
        decode_bytes(rgba(out / f"fire{kind}.png")[..., :3]) for kind in ("", ".flame", ".flakes")
    )
    assert flakes.max() > 0.2 and flame.max() > 0.2
    flame_light, flake_light = (
        shown / (1 - shown) for shown in (np.minimum(layer, 254 / 255) for layer in (flame, flakes))
    )
    film = (flame_light + flake_light) / (1 + flame_light + flake_light)
    added = np.where(flakes > 0, film, flame)
    steps = decode_bytes(np.arange(256, dtype=np.uint8))
    step = np.interp(page, steps[:-1], np.diff(steps)) + 1e-6
    assert (np.abs(added - page) / step).max() < 2.5  # half a step of each of the three, and more


def test_flakes_that_are_not_baked_can_be_had_alone(tmp_path: Path) -> None:
    out = build(tmp_path, maps={"flame": True, "flakes": True}, flakes={"bake": False})
    assert np.array_equal(rgba(out / "fire.png"), rgba(out / "fire.flame.png"))
    assert rgba(out / "fire.flakes.png").any()


def test_the_number_of_workers_changes_no_byte(tmp_path: Path) -> None:
    keys: dict[str, Any] = {"maps": {"motion": "unity", "flame": True, "flakes": True},
            "atlas": {**GRID, "max_size": 400, "scales": [1, 0.5]}}  # fmt: skip
    one, two = (build(tmp_path / jobs, "--jobs", jobs, **keys) for jobs in ("1", "2"))
    files = sorted(path.name for path in one.iterdir())
    assert files == sorted(path.name for path in two.iterdir())
    assert all((one / name).read_bytes() == (two / name).read_bytes() for name in files)


@pytest.mark.parametrize("engine", ["unity", "unreal"])
def test_cells_are_needed_where_an_engine_counts_them(tmp_path: Path, engine: str) -> None:
    assert "set atlas.layout to grid" in refused(tmp_path, maps={"motion": engine})


@pytest.mark.parametrize(
    ("maps", "keys", "advice"),
    [
        ({"motion": "godot"}, {"atlas": {"rotate": True}}, "leave out atlas.rotate"),
        ({"motion": "godot"}, {"atlas": {"dedupe": True}}, "leave out atlas.dedupe"),
        ({"flakes": True}, {"flakes": "none"}, "maps.flakes: this effect has no flakes"),
        ({"flame": True}, {"flakes": "none"}, "this map would be a copy of the page"),
        ({"motion": "unrael"}, {}, "did you mean unreal?"),
        ({"flakes": 1}, {}, "must be true or false"),
    ],
)
def test_what_cannot_be_is_refused_with_advice(
    tmp_path: Path, maps: dict[str, Any], keys: dict[str, Any], advice: str
) -> None:
    assert advice in refused(tmp_path, maps=maps, **keys)


def test_off_is_a_choice_and_writes_nothing(tmp_path: Path) -> None:
    out = build(tmp_path, maps={"motion": False})
    assert "maps" not in meta(out)
    assert not list(out.glob("*.motion.png"))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "least"), [("real_candle_red", None), ("sim_unity_flame02", 0.5)])
def test_frames_that_the_build_drops_from_its_source_validate_the_vectors(
    clips: Path, tmp_path: Path, name: str, least: float | None
) -> None:
    """The candle flickers once in two of its frames: every other one tells nothing of the rest."""
    out = build(
        tmp_path, source={"path": str(clips / name / "frames"), "fps": 24, "count": 24},
        timeline={"fps": 12, "loop": "none"}, maps={"motion": "unity"}, atlas=GRID,
        flakes="none", motion_blur="none",
    )  # fmt: skip
    statistics = json.loads((out / "fire.manifest.json").read_text())["statistics"]
    motion = statistics["motion"]
    assert motion["held_out"] == 8
    assert motion["written"] == (least is not None)
    if least is None:
        assert (rgba(out / "fire.motion.png") == (128, 128, 0, 255)).all()
    else:
        assert motion["gain"] > least


@pytest.mark.parametrize(
    ("name", "engine", "least"),
    [
        *(("campfire", engine, 0.2) for engine in ENGINES),
        ("candle", "unity", 0.2),
        ("fireball", "unity", 0.2),
        real("sim_unity_flame02", "unity", 0.5),
        real("cartoon_fluent_fire", "unity", 0.3),
        real("cartoon_tauran_flame_sheet", "unity", 0.2),
    ],
)
def test_dropped_frames_of_fire_are_met(
    tmp_path: Path, name: str, engine: str, least: float
) -> None:
    """Built from every other frame of 17, decoded by the engine's formula from the files; with
    the wrong signs of R or G it comes less close."""
    folder = shipped("samples") / name if name in SAMPLES else real_clips() / name / "frames"
    frames = sorted(folder.iterdir())[:17]
    (tmp_path / "half").mkdir()
    for frame in frames[::2]:
        (tmp_path / "half" / frame.name).write_bytes(frame.read_bytes())
    out = build(
        tmp_path, source={"path": "half", "fps": 12, "matte": "alpha"}, maps={"motion": engine},
        atlas={**GRID, "trim": "none", "cover": "full"}, flakes="none", motion_blur="none",
        timeline={"loop": "none"},
    )  # fmt: skip
    book, error = (
        read_flipbook(out, "fire"),
        dict.fromkeys(["plain", *map(str, RIGHT_AND_WRONG)], 0.0),
    )
    for i in range(len(book.places) - 1):
        truth = rgba(frames[2 * i + 1]).astype(np.float64)
        truth[..., :3] *= truth[..., 3:] / 255
        error["plain"] += float(np.mean((book.frame_part(plain(book, i, 0.5)) - truth) ** 2))
        for signs in RIGHT_AND_WRONG:
            seen = book.frame_part(ENGINES[engine](book, i, 0.5, signs))
            error[str(signs)] += float(np.mean((seen - truth) ** 2))
    right, *wrong = (1 - np.sqrt(error[str(s)] / error["plain"]) for s in RIGHT_AND_WRONG)
    assert right > least and max(wrong) < right
