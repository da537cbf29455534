"""An atlas that is written is the same when it is read back: its sheet, its pages, its frames."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import (
    AnimationFrames,
    AtlasSheet,
    Region,
    Sprite,
    State,
    StateGraph,
    StateTransition,
    VectorScale,
)
from fire_atlas.atlas.trim import trimmed
from fire_atlas.core.errors import OutputError, SourceError
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.atlas.texture_packer import export_json_hash, read_atlas
from fire_atlas.formats.pages.page_file import read_page, write_page
from fire_atlas.formats.templates.context import context_of
from fire_atlas.maps.maker import MappedFrame, with_maps
from fire_atlas.maps.vectors.estimate import Motion
from fire_atlas.preview.cut_frames import cut_frames
from fire_atlas.recipe.output import Atlas, Engine, Maps
from tests.support.sheets import sheet_with_meshes, sparks_and_others

FRAME = (26, 30)
"""Width and height of the untrimmed frames, px."""

NAMES = ("fire", "run", "a/b", "火 1")


@st.composite
def sprites(draw: st.DrawFn) -> Sprite:
    """A noisy part of a frame; some are empty, and some the same."""
    width, height = FRAME
    x, y = draw(st.integers(0, width - 1)), draw(st.integers(0, height - 1))
    right, bottom = draw(st.integers(x, width)), draw(st.integers(y, height))
    image = np.zeros((height, width, 4), np.uint8)
    noise = np.random.default_rng(draw(st.integers(0, 3))).integers(1, 256, image.shape)
    image[y:bottom, x:right] = noise[y:bottom, x:right]
    return trimmed(image)


animations = st.lists(
    st.builds(
        AnimationFrames,
        name=st.sampled_from(NAMES),
        sprites=st.lists(sprites(), min_size=1, max_size=9).map(tuple),
        duration=st.floats(1, 500),
        loop=st.booleans(),
        foot=st.none() | st.tuples(st.floats(0, 26), st.floats(0, 30)),
    ),
    min_size=1,
    max_size=3,
    unique_by=lambda animation: animation.name,
)

settings = st.builds(
    lambda **keys: Atlas.model_validate(keys),
    max_size=st.sampled_from([48, 64, 4096]),
    scales=st.sampled_from([[1], [1, 0.5]]),
    alpha=st.sampled_from(["straight", "premultiplied", "additive"]),
    blend_space=st.sampled_from(["srgb", "linear"]),
    format=st.sampled_from(["png", "webp"]),
    trim=st.sampled_from(["frame", "animation", "none"]),
    pivot=st.sampled_from(["base", "top", [0.1234567, -2]]),
    padding=st.integers(0, 4),
    dedupe=st.booleans(),
)
packed = settings.flatmap(
    lambda made: st.booleans().map(lambda turns: made.model_copy(update={"rotate": turns}))
)
grids = settings.map(lambda made: made.model_copy(update={"layout": "grid"}))


@st.composite
def sheets(draw: st.DrawFn) -> AtlasSheet:
    """Several pages, animations and scales, grids, and all kinds of maps."""
    asked = draw(packed | grids)
    try:
        sheet = draw(st.sampled_from(build_sheets("fire", draw(animations), asked, shares=False)))
    except OutputError:
        assume(False)
        raise
    engines: tuple[Engine, ...] = ("unity", "unreal", "godot") if sheet.grid else ("godot",)
    engine = draw(st.none() | st.sampled_from(engines))
    reach = draw(st.tuples(st.floats(0, 20), st.floats(0, 20)))
    motion = Motion(*FRAME, (np.zeros((2, 2, 2), np.float16),), reach, None)
    layers = dict.fromkeys(draw(st.sets(st.sampled_from(["flame", "flakes", "smoke"]))), True)
    maps = Maps.model_validate({"motion": engine or "none", **layers})
    return with_maps(sheet, [MappedStub({"motion": motion})], maps)


class MappedStub(NamedTuple):
    """An animation of which only maps are asked for."""

    maps: dict[str, Any]
    frames: tuple[MappedFrame, ...] = ()


def rounded(sheet: AtlasSheet) -> AtlasSheet:
    """Return a sheet with numbers as the JSON has them."""

    def region(each: Region) -> Region:
        x, y = (round(part, 6) for part in each.anchor)
        return replace(each, anchor=(x, y), duration=round(each.duration, 3))

    def scale(each: VectorScale | None) -> VectorScale | None:
        if each is None:
            return None
        return replace(
            each,
            scale=round(each.scale, 9),
            pixels=pair(each.pixels, 6),
            cell_uv=each.cell_uv and pair(each.cell_uv, 9),
            longest=pair(each.longest, 3),
        )

    def pair(values: tuple[float, float], digits: int) -> tuple[float, float]:
        return round(values[0], digits), round(values[1], digits)

    return replace(
        sheet,
        fps=round(sheet.fps, 6),
        regions=tuple(map(region, sheet.regions)),
        maps=tuple(replace(each, vectors=scale(each.vectors)) for each in sheet.maps),
    )


def write_json(sheet: AtlasSheet, folder: Path) -> Path:
    for file in export_json_hash(sheet):
        (folder / file.name).write_bytes(file.data)
    return folder / sheet.file(0, ".json")


@given(sheet=sheets())
def test_a_sheet_comes_back_as_it_was(
    sheet: AtlasSheet, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = write_json(sheet, tmp_path_factory.mktemp("a"))
    assert read_atlas(path).sheet == rounded(sheet)


@pytest.mark.slow
@given(made=animations, asked=packed | grids)
def test_frames_come_back_from_the_files_of_their_pages(
    made: list[AnimationFrames], asked: Atlas, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("a")
    try:
        sheet = build_sheets("fire", made, asked)[0]
    except OutputError:
        assume(False)
        raise
    drawn = [sprite for animation in made for sprite in animation.sprites]
    with Workers(1) as workers:
        for i, page in enumerate(sheet.pages):
            with (folder / page.file).open("wb") as file:
                write_page(file, draw_page(sheet, i, drawn, Edges.of(asked, 1.0)), asked, workers)
    frames = list(cut_frames(read_atlas(write_json(sheet, folder))))
    for frame, sprite in zip(frames, drawn, strict=True):
        whole = np.zeros_like(frame)
        height, width = sprite.image.shape[:2]
        whole[sprite.y : sprite.y + height, sprite.x : sprite.x + width] = sprite.image
        np.testing.assert_array_equal(frame, whole)


@pytest.mark.parametrize("atlas", [{}, {"rotate": True}, {"layout": "grid"}])
def test_meshes_come_back_as_they_were(atlas: dict[str, Any], tmp_path: Path) -> None:
    sheet = sheet_with_meshes(sparks_and_others(), **atlas)
    sparks, full, empty, again = (sheet.regions[i] for i in (0, 4, 5, 6))
    assert sparks.mesh is not None and 4 < len(sparks.mesh.vertices) <= 7
    assert not sparks.fills_rectangle
    assert full.fills_rectangle and again.mesh == sparks.mesh
    assert empty.fills_rectangle
    path = write_json(sheet, tmp_path)
    assert read_atlas(path).sheet == rounded(sheet)
    frames = context_of(sheet)["frames"]
    assert frames[0]["mesh"]["vertices"] == [list(each) for each in sparks.mesh.vertices]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda frame: frame["vertices"].append([41, 0]), "41 is not a number from"),
        (lambda frame: frame["vertices"].append([9.5, 9]), "9.5 is not a number from"),
        (lambda frame: frame["triangles"].append([0, 1, 99]), "99 is not a number from 0 to"),
        (lambda frame: frame["triangles"].append([0, 1]), "ValueError"),
        (lambda frame: frame.pop("triangles"), "KeyError: 'triangles'"),
        (lambda frame: frame.update(vertices=[], triangles=[]), "not clockwise around an area"),
        (lambda frame: frame["vertices"].reverse(), "not clockwise around an area"),
    ],
)
def test_meshes_of_another_making_are_refused(
    change: Callable[[dict[str, Any]], object], reason: str, tmp_path: Path
) -> None:
    path = write_json(sheet_with_meshes(sparks_and_others()), tmp_path)
    document = json.loads(path.read_bytes())
    change(document["frames"]["fire/0000"])
    path.write_text(json.dumps(document))
    with pytest.raises(SourceError, match=f"is not an atlas that fire-atlas wrote.*{reason}"):
        read_atlas(path)


plain = arrays(np.uint8, st.tuples(st.integers(1, 80), st.integers(1, 9), st.just(4)))
grey = plain.map(lambda image: image[..., [0, 0, 0, 3]])
opaque = plain.map(lambda image: np.dstack([image[..., :3], np.full(image.shape[:2], 255, "u1")]))


@pytest.mark.slow
@pytest.mark.parametrize("asked", [
    Atlas(format="png", compression="fast"), Atlas(format="png", compression="small"),
    Atlas(format="webp", compression="fast"), Atlas(format="webp", compression="small"),
])  # fmt: skip
@given(image=plain | grey | opaque)
def test_pages_come_back_bit_for_bit(
    asked: Atlas, image: Bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Those too that have no colours, or no transparency, which small files leave out."""
    path = tmp_path_factory.mktemp("a") / "fire"
    with Workers(1) as workers, path.open("wb") as file:
        write_page(file, image, asked, workers)
    height, width = image.shape[:2]
    np.testing.assert_array_equal(read_page(path, width, height), image)


def test_frames_with_durations_that_no_animation_plays_are_no_atlas(tmp_path: Path) -> None:
    path = write_json(sheet_with_meshes(sparks_and_others()), tmp_path)
    document = json.loads(path.read_bytes())
    document["animations"] = {}
    path.write_text(json.dumps(document))
    with pytest.raises(SourceError, match="it has no frames"):
        read_atlas(path)


def test_a_damaged_page_is_refused(tmp_path: Path) -> None:
    image = np.random.default_rng(0).integers(0, 256, (40, 40, 4), np.uint8)
    with Workers(1) as workers, (tmp_path / "fire.png").open("wb") as file:
        write_page(file, image, Atlas(), workers)
    whole = (tmp_path / "fire.png").read_bytes()
    (tmp_path / "fire.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(SourceError, match=r"fire\.png: is damaged .*build the recipe again"):
        read_page(tmp_path / "fire.png", 40, 40)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda motion: motion.update(engine="frostbite"), "'frostbite' is not an engine"),
        (lambda motion: motion.update(engine=["unity"]), "is not an engine"),
        (lambda motion: motion.pop("scale"), "KeyError: 'scale'"),
        (lambda motion: motion["strength"].update(pixels=[1]), "IndexError"),
        (lambda motion: motion.update(image="../fire.png"), "is not a plain file name"),
        (lambda motion: motion.update(image="c:fire.png"), "is not a plain file name"),
    ],
)
def test_motion_vectors_of_another_making_are_refused(
    change: Callable[[dict[str, Any]], object], reason: str, tmp_path: Path
) -> None:
    animation = AnimationFrames(
        "fire", (trimmed(np.full((8, 8, 4), 9, np.uint8)),), 40.0, True, None
    )
    cells: NDArray[np.float16] = np.zeros((2, 2, 2), np.float16)
    mapped = MappedStub({"motion": Motion(8, 8, (cells,), (1.0, 1.0), None)})
    (sheet,) = build_sheets("fire", [animation], Atlas(layout="grid"))
    sheet = with_maps(sheet, [mapped], Maps(motion="unity"))
    path = write_json(sheet, tmp_path)
    document = json.loads(path.read_bytes())
    change(document["meta"]["maps"][0])
    path.write_text(json.dumps(document))
    with pytest.raises(SourceError, match=f"is not an atlas that fire-atlas wrote.*{reason}"):
        read_atlas(path)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda graph: graph["states"].pop("gale"), "two or more that increase"),
        (lambda graph: graph["states"]["gale"].update(wind=9), "9 is not a number from 0 to 5"),
        (lambda graph: graph["states"].update(storm={"wind": 5}), "'storm' is not one of"),
        (lambda graph: graph["transitions"][0].update(to="storm"), "'storm' is not one of"),
        (lambda graph: graph["transitions"][0].update(frame=2), "2 is not a number from 0 to 1"),
        (lambda graph: graph.pop("transitions"), "KeyError: 'transitions'"),
    ],
)
def test_a_graph_of_states_of_another_making_is_refused(
    change: Callable[[dict[str, Any]], object], reason: str, tmp_path: Path
) -> None:
    frame = trimmed(np.full((8, 8, 4), 9, np.uint8))
    loops = [AnimationFrames(n, (frame, frame), 40.0, True, None) for n in ("calm", "gale")]
    states = StateGraph(
        (State("calm", wind=0.0), State("gale", wind=3.0)),
        (StateTransition("calm", 1, "gale", 0),),
    )
    path = write_json(replace(build_sheets("fire", loops, Atlas())[0], states=states), tmp_path)
    document, sheet = json.loads(path.read_bytes()), read_atlas(path).sheet
    assert sheet.states == states
    assert context_of(sheet)["states"] == document["meta"]["states"]
    change(document["meta"]["states"])
    path.write_text(json.dumps(document))
    with pytest.raises(SourceError, match=f"is not an atlas that fire-atlas wrote.*{reason}"):
        read_atlas(path)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda states: states["ignite"].pop("next"), "KeyError: 'next'"),
        (lambda states: states["ignite"].update(next="storm"), "'storm' is not one of"),
        (lambda states: states["burn"].update(phase="glow"), "'glow' is not one of"),
        (lambda states: states["burn"].pop("phase"), "KeyError: 'wind'"),
        (lambda states: states["extinguish"].pop("phase"), "None is not one of"),
        (lambda states: states.pop("burn"), "two or more that increase"),
    ],
)
def test_phases_are_read_as_written_and_of_another_making_refused(
    change: Callable[[dict[str, Any]], object], reason: str, tmp_path: Path
) -> None:
    frame = trimmed(np.full((8, 8, 4), 9, np.uint8))
    names = "burn", "ignite", "extinguish"
    played = [AnimationFrames(n, (frame, frame), 40.0, n == "burn", None) for n in names]
    states = StateGraph(
        (
            State("burn", phase="burn"),
            State("ignite", following="burn", phase="ignite"),
            State("extinguish", phase="extinguish"),
        ),
        (StateTransition("ignite", 1, "burn", 0), StateTransition("burn", 1, "extinguish", 0)),
    )
    path = write_json(replace(build_sheets("fire", played, Atlas())[0], states=states), tmp_path)
    document = json.loads(path.read_bytes())
    assert read_atlas(path).sheet.states == states
    change(document["meta"]["states"]["states"])
    path.write_text(json.dumps(document))
    with pytest.raises(SourceError, match=f"is not an atlas that fire-atlas wrote.*{reason}"):
        read_atlas(path)
