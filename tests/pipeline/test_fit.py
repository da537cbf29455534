"""A budget, ``fit``: it is kept to the byte, and best spent."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.atlas.encode import encode_frame
from fire_atlas.atlas.gpu import light_of
from fire_atlas.atlas.page_rules import PackingUnits
from fire_atlas.atlas.trim import trimmed
from fire_atlas.core.context import BuildContext
from fire_atlas.core.pixels import hex_to_linear
from fire_atlas.core.workers import Workers
from fire_atlas.formats.textures.blocks import FORMATS, decode_blocks
from fire_atlas.formats.textures.encode import encode_images
from fire_atlas.pipeline.animation.contribution import FinishedAnimation
from fire_atlas.pipeline.animation.render import RenderedFrame
from fire_atlas.pipeline.fit.budget_search import FitSearch
from fire_atlas.pipeline.fit.fit import closest, searches_of
from fire_atlas.pipeline.fit.frames import DAY, as_textures, at_heights, squared_errors
from fire_atlas.pipeline.fit.packed import cells_of, packed
from fire_atlas.pipeline.fit.selection import holds, selections
from fire_atlas.recipe.fit import READY_BUDGETS, Fit
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Atlas
from tests.support.repo import Repo, pages

MIB = 1 << 20


def manifest(repo: Repo, name: str = "fire") -> dict[str, Any]:
    statistics: dict[str, Any] = json.loads((repo.build / f"{name}.manifest.json").read_text())[
        "statistics"
    ]
    return statistics


def played(build: Path, fps: float, name: str = "fire") -> list[NDArray[np.float64]]:
    """What a client shows that has the JSON and the pages alone, at the rate of the whole: each
    frame whole, premultiplied, sRGB."""
    shown = list[NDArray[np.float64]]()
    for page, image in pages(build, name):
        for entry in page["frames"].values():
            place, trim, whole = entry["frame"], entry["spriteSourceSize"], entry["sourceSize"]
            cut = image[place["y"] : place["y"] + place["h"], place["x"] : place["x"] + place["w"]]
            frame = np.zeros((whole["h"], whole["w"], 4))
            frame[trim["y"] : trim["y"] + place["h"], trim["x"] : trim["x"] + place["w"]] = cut
            times = entry["duration"] * fps / 1000
            assert times == pytest.approx(round(times), abs=1e-3)
            shown += [frame] * round(times)
    return shown


BUDGETS: list[dict[str, Any]] = [
    {"memory": 0.02}, {"memory": 0.05}, {"memory": 0.2}, {"memory": 0.05, "page": 64, "pages": 2},
    {"page": 128}, {"cells": 3}, {"shown": 40}, {"cells": 4, "memory": 0.03},
]  # fmt: skip


@pytest.mark.parametrize("fit", BUDGETS, ids=str)
@pytest.mark.parametrize(
    "atlas",
    [{}, {"layout": "grid"}, {"pot": True}, {"trim": "none", "alpha": "additive"},
     {"pixels": "heat"}],
    ids=str,
)  # fmt: skip
def test_the_budget_is_kept(fit: dict[str, Any], atlas: dict[str, Any], repo: Repo) -> None:
    repo.clip(count=12)
    recipe = repo.recipe(fit=fit, atlas=atlas)
    ran = repo.run("build", recipe)
    if ran.code:
        assert "nothing fits" in ran.err and "page" in fit, ran.err
        return
    found = manifest(repo)
    sizes = [image.shape[:2] for _, image in pages(repo.build, "fire")]
    channels = 1 if atlas.get("pixels") == "heat" else 4
    memory = sum(height * width * channels for height, width in sizes)
    assert sum(found["memory"].values()) == found["fit"]["memory"] == memory
    assert memory <= fit.get("memory", 99) * MIB
    assert max(map(max, sizes)) <= fit.get("page", 4096) and len(sizes) <= fit.get("pages", 1)
    assert found["frames"] <= fit.get("cells", 99)
    assert found["frame_size"][1] <= fit.get("shown", 80)


def test_compressed_textures_count_as_the_largest_of_them(repo: Repo) -> None:
    """Those of heat, among which there is no choice."""
    repo.clip(count=12)
    gpu = ["astc-8x8.ktx2", "astc-4x4.ktx2", "bc4.dds"]
    atlas = {"gpu": gpu, "gpu_quality": "draft", "pixels": "heat"}
    repo.built(repo.recipe(fit={"memory": 0.02}, atlas=atlas, flakes="none"))
    found = manifest(repo)
    assert found["fit"]["memory"] == found["memory"]["astc-4x4"] <= 0.02 * MIB
    assert found["memory"]["bc4"] * 2 == found["memory"]["astc-4x4"]
    assert found["memory"]["astc-8x8"] * 3 < found["memory"]["astc-4x4"]
    headers = 148
    assert (repo.build / "fire.bc4.dds").stat().st_size == headers + found["memory"]["bc4"]
    assert "blocks" not in found["fit"]


ASTC, BC7 = ["astc-8x8.ktx2", "astc-4x4.ktx2"], ["bc7.dds", "bc7.ktx2"]


@pytest.mark.parametrize(
    ("memory", "listed", "blocks"),
    [
        (0.01, ASTC, ["astc-8x8"]),
        (8, ASTC, ["astc-4x4"]),
        # All families show the same pages, and BC7 takes as much as ASTC of 4 x 4.
        (0.01, ASTC + BC7, ["astc-4x4", "bc7"]),
    ],
)
def test_each_family_of_devices_gets_the_blocks_that_come_closest(
    memory: float, listed: list[str], blocks: list[str], repo: Repo
) -> None:
    repo.clip(count=6)
    atlas = {"gpu": listed, "gpu_quality": "draft", "alpha": "premultiplied"}
    recipe = repo.recipe(fit={"memory": memory}, atlas=atlas)
    repo.built(recipe)
    found = manifest(repo)
    assert found["fit"]["blocks"] == blocks
    assert found["fit"]["memory"] == max(found["memory"][each] for each in blocks)
    assert found["fit"]["memory"] <= memory * MIB
    textures = {path.name for path in repo.build.iterdir() if path.suffix in (".dds", ".ktx2")}
    assert textures == {f"fire.{each}" for each in listed if each.partition(".")[0] in blocks}
    assert repo.run("build", recipe).is_up_to_date
    assert blocks[0] in repo.run("inspect", repo.build / "fire.json", "--budget").out


def test_what_is_left_plays_as_long_and_each_frame_is_one_of_the_whole(repo: Repo) -> None:
    repo.clip(count=12)
    keys: dict[str, Any] = {"timeline": {"loop": "none"}, "tracks": []}
    repo.built(repo.recipe("whole.yaml", **keys))
    whole = manifest(repo, "whole")
    repo.built(repo.recipe(fit={"cells": 5}, **keys))
    found = manifest(repo)
    assert (found["frames"], found["frame_size"]) == (5, whole["frame_size"])
    full = played(repo.build, whole["fps"], "whole")
    shown = played(repo.build, whole["fps"])
    assert len(shown) == len(full) == 12
    changes = [i for i in range(12) if i == 0 or not np.array_equal(shown[i], shown[i - 1])]
    assert len(changes) == 5
    for i in changes:
        assert np.array_equal(shown[i], full[i])


@pytest.mark.parametrize("exports", [["phaser"], ["tpsheet"], ["unity"]], ids=str)
def test_clients_that_know_no_durations_get_frames_that_last_equally_long(
    exports: list[str], repo: Repo
) -> None:
    repo.clip(count=12)
    keys: dict[str, Any] = {"timeline": {"loop": "none"}, "exports": ["json", *exports]}
    repo.built(repo.recipe(**keys, fit={"cells": 5}))
    ((page, _),) = pages(repo.build, "fire")
    durations = {entry["duration"] for entry in page["frames"].values()}
    assert len(page["frames"]) == 5 and len(durations) == 1
    rate = manifest(repo)["fps"]
    assert durations.pop() == pytest.approx(12 / 5 * 1000 / rate, abs=1e-3)


def test_more_is_closer_and_the_curve_says_so(repo: Repo) -> None:
    repo.clip(count=12)
    repo.built(repo.recipe(fit={"memory": 0.08}))
    curve = manifest(repo)["fit"]["curve"]
    assert [round(point["budget"] / MIB, 3) for point in curve] == [0.02, 0.04, 0.08, 0.16, 0.32]
    errors = [point["error"] for point in curve]
    assert errors == sorted(errors, reverse=True) and errors[0] > errors[-1] == 0
    assert all(point["memory"] <= point["budget"] for point in curve)


@pytest.mark.parametrize("atlas", [{}, {"gpu": ASTC, "gpu_quality": "draft"}], ids=str)
def test_any_number_of_workers_gives_the_same_bytes(atlas: dict[str, Any], repo: Repo) -> None:
    repo.clip(count=12)
    recipe = repo.recipe(fit={"memory": 0.06}, atlas=atlas)
    first = repo.built(recipe, "--jobs", "1")
    for jobs in ("2", "8"):
        assert repo.built(recipe, "--force", "--jobs", jobs) == first


@pytest.mark.parametrize("alpha", ["straight", "premultiplied", "additive"])
def test_errors_are_those_over_black_and_over_the_day(alpha: Any) -> None:
    # What is added in sRGB adds other light over the day than over black.
    space: Any = "linear" if alpha == "additive" else "srgb"
    atlas, chance = Atlas(alpha=alpha, blend_space=space), np.random.default_rng(1)
    day = hex_to_linear([DAY])[0]
    pictures = []
    for _ in range(3):
        cover = chance.random((20, 16, 1), np.float32)
        colour = chance.random((20, 16, 3), np.float32)
        pictures.append(np.concatenate([colour * cover, cover], axis=2).astype(np.float32))
    sprites = [trimmed(encode_frame(picture, alpha, space)) for picture in pictures]
    with Workers(2) as workers:
        errors = squared_errors(sprites, [sprites], atlas, workers)[0]
    for i, one in enumerate(pictures):
        for j, other in enumerate(pictures):
            light, hidden = one[..., :3] - other[..., :3], one[..., 3:] - other[..., 3:]
            over_day = light if alpha == "additive" else light - hidden * day
            expected = float(np.sum(light**2) + np.sum(over_day**2))
            assert errors[i, j] == pytest.approx(expected, rel=0.02, abs=1e-9)


def test_a_frame_made_smaller_keeps_its_light() -> None:
    picture = np.zeros((40, 32, 4), np.float32)
    picture[8:24, 8:24] = [0.5, 0.25, 0.125, 0.5]
    sprite = trimmed(encode_frame(picture, "premultiplied", "srgb"))
    frame = RenderedFrame((sprite,), {}, None, 32, 40)
    animation = FinishedAnimation([frame], 24, True, foot=(16, 38))
    with Workers(1) as workers:
        same, half = at_heights(animation, [40, 20], Atlas(alpha="premultiplied"), workers)
    assert same.frames[0] is frame
    (small,) = half.frames[0].sprites
    assert (small.frame_width, small.frame_height, half.foot) == (16, 20, (8, 19))
    assert (small.x, small.y, *small.image.shape) == (4, 4, 8, 8, 4)
    assert np.abs(small.image.astype(int) - sprite.image[0, 0]).max() <= 1


@pytest.mark.parametrize("seed", range(6))
def test_of_each_number_of_frames_the_best_is_found(seed: int) -> None:
    chance, count = np.random.default_rng(seed), 14
    errors = chance.random((count, count)) ** 3
    np.fill_diagonal(errors, 0.01 * chance.random(count))

    def error(kept: Sequence[int]) -> float:
        shown = np.repeat(kept, holds(tuple(kept), count))
        return float(errors[np.arange(count), shown].sum())

    found = selections(errors, count, is_even=False)
    for number in range(1, count + 1):
        best = min(error((0, *others)) for others in combinations(range(1, count), number - 1))
        ours = min(each.error for each in found if len(each.kept) == number)
        assert ours == pytest.approx(best)
    assert all(each.error == pytest.approx(error(each.kept)) for each in found)


def all_searches(
    frames: Sequence[RenderedFrame], context: BuildContext, **atlas: Any
) -> list[FitSearch]:
    animations = {"fire": FinishedAnimation(list(frames), 24, True)}
    keys: Mapping[str, Any] = {"source": {"path": "clip"}, "atlas": atlas, "fit": {"memory": 1}}
    return searches_of(animations, Recipe.model_validate(keys), Fit(memory=1), context)


def search_of(frames: Sequence[RenderedFrame], context: BuildContext, **atlas: Any) -> FitSearch:
    (search,) = all_searches(frames, context, **atlas)
    return search


def flames(count: int, height: int = 48) -> list[RenderedFrame]:
    """Frames of a flame that grows, shrinks and leans."""
    y, x = np.mgrid[:height, :40].astype(np.float32)
    frames = []
    for i in range(count):
        phase = 2 * np.pi * i / count
        top = 0.5 + 0.3 * np.sin(phase) + 0.05 * np.sin(3 * phase)
        middle = 20 + 6 * np.sin(2 * phase + 1) * (1 - y / height)
        cover = np.clip(1.6 - np.abs(x - middle) / 6, 0, 1) * (y > height * (1 - top))
        light = cover[..., None] * np.array([1, 0.5, 0.1], np.float32)
        picture = np.concatenate([light, cover[..., None]], axis=2).astype(np.float32)
        sprite = trimmed(encode_frame(picture, "premultiplied", "srgb"))
        frames.append(RenderedFrame((sprite,), {}, None, 40, height))
    return frames


@pytest.mark.parametrize("atlas", [{}, {"gpu": ["bc7.dds"]}], ids=str)
def test_of_a_short_clip_the_best_of_all_heights_and_frames_is_found(atlas: Any) -> None:
    count = 8
    with Workers(2) as workers:
        context = BuildContext.silent(workers)
        search = search_of(flames(count), context, alpha="premultiplied", **atlas)
        search.levels = dict(list(search.levels.items())[:3])
        every = {
            (height, choice.kept): (choice.error, search.pack(height, choice.kept))
            for height, level in search.levels.items()
            for choice in level.choices
        }
        assert len(every) == 3 * 2 ** (count - 1)
        sizes = sorted(memory for _, memory in every.values() if memory is not None)
        for limit in (sizes[0] - 1, *sizes[20::60]):
            best: tuple[float, int, tuple[int, ...]] | None = None
            for height in sorted(search.levels, reverse=True):
                for (of, kept), (error, memory) in every.items():
                    if of != height or memory is None or memory > limit:
                        continue
                    buys_more = best is None or height == best[1] or len(kept) > len(best[2])
                    if buys_more and (best is None or (error, len(kept)) < (best[0], len(best[2]))):
                        best = error, height, kept
            found = search.best(limit)
            assert (found is None) == (best is None)
            if found is not None and best is not None:
                assert every[found.height, found.kept] == (best[0], found.memory)
                assert found.height == best[1] and found.memory <= limit


SEVEN = [
    "bc1.dds", "bc3.dds", "bc7.dds", "astc-4x4.ktx2", "astc-5x5.ktx2", "astc-6x6.ktx2",
    "astc-8x8.ktx2",
]  # fmt: skip


@pytest.mark.parametrize(
    ("gpu", "count", "choices"),
    [(["astc-4x4.ktx2", "astc-6x6.ktx2"], 8, 2), (SEVEN, 6, 3 * 4)],
    ids=["two", "seven"],
)
def test_of_several_kinds_of_blocks_the_best_of_all_trials_is_found(
    gpu: list[str], count: int, choices: int
) -> None:
    """Each choice of each search is packed here, without what searches share."""
    with Workers(2) as workers:
        context = BuildContext.silent(workers)
        searches = all_searches(flames(count), context, alpha="premultiplied", gpu=gpu)
        every = list[tuple[float, int]]()
        for search in searches:
            search.levels = dict(list(search.levels.items())[:1])
            (height,) = search.levels
            for choice in search.levels[height].choices:
                memory = search.pack(height, choice.kept)
                assert memory is not None
                every.append((choice.error, memory))
        assert len(every) == choices * 2 ** (count - 1)
        sizes, chosen = sorted(memory for _, memory in every), set[tuple[str, ...]]()
        for limit in dict.fromkeys(sizes):
            found = closest(searches, limit)
            assert found is not None
            search, trial = found
            chosen.add(trial.blocks)
            error_of = {c.kept: c.error for c in search.levels[trial.height].choices}
            best = min(error for error, memory in every if memory <= limit)
            assert error_of[trial.kept] == best and trial.memory <= limit
            assert trial.memory == search.pack(trial.height, trial.kept)
        assert len(chosen) > 1
        assert closest(searches, sizes[0] - 1) is None


def test_what_searches_share_is_what_each_finds_alone() -> None:
    with Workers(2) as workers:
        context = BuildContext.silent(workers)
        frames, keys = flames(7), {"alpha": "premultiplied"}
        together = all_searches(frames, context, gpu=SEVEN[2:6:2] + SEVEN[5:], **keys)
        assert len(together) == 3
        for search in together:
            search.add([40, 30])
            gpu = search.atlas_for((0,)).gpu
            alone = search_of(frames, context, gpu=gpu, **keys)
            alone.add([30, 40])
            assert search.levels.keys() == alone.levels.keys()
            for height, level in alone.levels.items():
                assert level.choices == search.levels[height].choices
            for limit in (2000, 6000, 20000, 60000):
                one, other = search.best(limit), alone.best(limit)
                assert (one and one._replace(blocks=())) == other
            assert other is not None


@pytest.mark.parametrize(
    "keys",
    [
        {}, {"trim": "animation"}, {"dedupe": False}, {"max_pages": 3, "max_size": 64},
        {"layout": "grid"}, {"gpu": ("astc-6x6.ktx2",)}, {"rotate": True, "square": True},
    ],
    ids=str,
)  # fmt: skip
def test_choices_with_equal_cells_take_equal_pages(keys: dict[str, Any]) -> None:
    """Of two animations that have frames in common."""
    frames, count = flames(9), 6
    animations = {
        "first": FinishedAnimation(frames[:count], 24, True),
        "second": FinishedAnimation(frames[3:], 24, True),
    }
    atlas = Atlas(**{"max_pages": 1, "alpha": "premultiplied", **keys})
    source: Mapping[str, Any] = {"source": {"path": "clip"}}
    recipe = Recipe.model_validate(source).model_copy(update={"atlas": atlas})
    kept = [(0, *others) for n in range(count) for others in combinations(range(1, count), n)]
    units = PackingUnits.of(atlas)
    pages: dict[Any, set[Any]] = {}
    for choice, cells in zip(
        kept, cells_of(list(animations.values()), kept, atlas, units), strict=True
    ):
        left = {
            name: replace(animation, frames=[animation.frames[i] for i in choice])
            for name, animation in animations.items()
        }
        sheet = packed(recipe, left)
        taken = () if sheet is None else tuple((page.width, page.height) for page in sheet.pages)
        pages.setdefault(cells, set()).add(taken)
        if len(taken) == 1:
            assert cells.least_page(units.rules) * units.px**2 <= taken[0][0] * taken[0][1]
    assert all(len(taken) == 1 for taken in pages.values())
    assert "gpu" not in keys or len(pages) < len(kept)


@pytest.mark.parametrize("blocks", ["bc7", "astc-6x6"])
def test_errors_have_in_them_what_compression_changes(blocks: str) -> None:
    settings = Atlas(alpha="premultiplied")
    sprites = [frame.sprites[0] for frame in flames(3)]
    with Workers(2) as workers:
        (heights,) = as_textures([sprites], [blocks], settings, workers)
        errors = squared_errors(sprites, heights, settings, workers)[0]
        exact = squared_errors(sprites, [sprites], settings, workers)[0]
        for i, (sprite, shown) in enumerate(zip(sprites, heights[0], strict=True)):
            format_, (height, width, _) = FORMATS[blocks], sprite.image.shape
            ((data,),) = encode_images([sprite.image], [format_], False, workers, quality="draft")
            wanted = decode_blocks(data, width, height, format_, False, workers)
            assert np.array_equal(shown.image, wanted)
            off = light_over_black(wanted) - light_over_black(sprite.image)
            assert errors[i, i] >= np.sum(off**2) > 0 and exact[i, i] == 0


def light_over_black(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Light over black of the bytes of a premultiplied page."""
    return light_of(image, Atlas(alpha="premultiplied"))[..., :3]


def test_it_is_never_worse_than_every_nth_frame_at_the_same_memory() -> None:
    with Workers(2) as workers:
        search = search_of(flames(30), BuildContext.silent(workers), alpha="premultiplied")
        top = search.levels[48]
        error_of = {choice.kept: choice.error for choice in top.choices}
        for step in (2, 3, 5, 7):
            kept = tuple(range(0, 30, step))
            memory = search.pack(48, kept)
            assert memory is not None
            found = search.best(memory)
            assert found is not None and found.memory <= memory
            ours = {c.kept: c.error for c in search.levels[found.height].choices}[found.kept]
            assert ours <= error_of[kept]


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"atlas": {"scales": [1, 0.5]}}, "atlas.scales"),
        ({"atlas": {"bits": 16}}, "atlas.bits"),
        ({"atlas": {"pixels": "heat4"}}, "atlas.pixels"),
        ({"atlas": {"max_size": 4096}}, "atlas.max_size"),
        ({"atlas": {"max_pages": 3}}, "atlas.max_pages"),
        ({"atlas": {"layout": "grid", "grid": {"columns": 2, "rows": 2}}}, "atlas.grid"),
        ({"tracks": ["json"]}, "tracks"),
        ({"tracks": ["light"]}, "tracks"),
        ({"maps": {"motion": "godot"}}, "maps.motion"),
        ({"maps": {"flame": True}}, "maps.flame"),
        ({"wind": {"levels": [0, 2]}}, "fit"),
        ({"phases": {"ignite": 1}}, "fit"),
        ({"variants": 2}, "fit"),
        ({"flakes": {"bake": False}}, "flakes.bake"),
        ({"source": {"kind": "sprites", "path": "clip"}}, "fit"),
        ({"fit": {}}, "fit"),
        ({"fit": {"cells": [3]}, "atlas": {"layout": "grid"}}, "fit.cells"),
    ],
    ids=str,
)
def test_what_a_budget_cannot_have_is_refused(keys: dict[str, Any], key: str, repo: Repo) -> None:
    repo.clip(count=2)
    fit = {"page": 512, "pages": 2, "memory": 1}
    ran = repo.run("check", repo.recipe(**{"fit": fit, **keys}))
    assert ran.code == 2
    assert f"fire.yaml:1: {key}" in ran.err, ran.err


def test_what_stands_in_the_way_is_named(repo: Repo) -> None:
    repo.clip(count=6)
    recipe = repo.recipe(fit={"memory": 0.001}, atlas={"padding": 2, "border": 40})
    ran = repo.run("build", recipe)
    assert ran.code == 2 and "fire.yaml:1: fit: nothing fits" in ran.err
    said = " ".join(ran.err.split())
    assert "in the way: atlas.border" in said and "padding" not in said


@pytest.mark.clips
@pytest.mark.parametrize(("name", "memory"), [("real_candle_red", 1), ("sim_unity_flame03", 4)])
def test_the_budget_is_kept_on_real_clips(
    name: str, memory: float, clips: Path, repo: Repo
) -> None:
    recipe = repo.recipe(path=str(clips / name / "frames"), fit={"memory": memory})
    repo.built(recipe)
    found = manifest(repo)
    assert sum(found["memory"].values()) <= memory * MIB


def test_inspect_and_the_preview_show_what_other_budgets_would_give(repo: Repo) -> None:
    repo.clip(count=12)
    recipe = repo.recipe(fit={"memory": 0.08})
    repo.built(recipe)
    found, atlas = manifest(repo)["fit"], repo.build / "fire.json"
    rows = repo.run("inspect", atlas, "--budget").out.splitlines()
    whole = found["of"]["frames"]
    chosen = f"{found['frames']} of {whole} frames, {found['height']} of 80 px high"
    assert chosen in rows[-1] and chosen in repo.run("inspect", atlas).out
    assert [row.split()[:4] for row in rows[1:-1]] == [
        [f"{point['budget'] / MIB:.4g}", "MiB", str(point["frames"]), str(point["height"])]
        for point in found["curve"]
    ]
    assert repo.run("preview", atlas, "-o", repo.folder / "built.html").code == 0
    assert repo.run("preview", recipe, "-o", repo.folder / "made.html").code == 0
    for name in ("built", "made"):
        html = (repo.folder / f"{name}.html").read_text()
        assert chosen in html and html.count("<circle") == len(found["curve"])
        assert html.count('class="chosen"') == 1
    repo.built(repo.recipe("plain.yaml"))
    assert repo.run("inspect", repo.build / "plain.json", "--budget").out == "budget: none\n"


@pytest.mark.parametrize(("count", "cells"), [(12, 4), (24, 16)])
def test_roblox_gets_a_full_square_grid(count: int, cells: int, repo: Repo) -> None:
    repo.clip(count=count)
    repo.built(repo.recipe(fit="roblox", timeline={"loop": "none"}))
    ((page, image),) = pages(repo.build, "fire")
    side = round(cells**0.5)
    assert image.shape[0] == image.shape[1] <= 1024
    places = [(entry["frame"]["x"], entry["frame"]["y"]) for entry in page["frames"].values()]
    cell = image.shape[0] // side
    assert [(x // cell, y // cell) for x, y in places] == [
        (x, y) for y in range(side) for x in range(side)
    ]


@pytest.mark.parametrize("name", ["unity-mobile", "vrchat", "web"])
def test_a_ready_budget_is_the_block_that_it_stands_for(name: str, repo: Repo) -> None:
    repo.clip(count=2)
    budget, _ = READY_BUDGETS[name]
    ran = repo.run("check", repo.recipe(fit=name), "--resolved")
    assert f"memory: {budget['memory']:.1f}" in ran.out and f"max_size: {budget['page']}" in ran.out
    other = repo.run("check", repo.recipe(fit=name, atlas={"max_size": 256}), "--resolved")
    assert "max_size: 256" in other.out
