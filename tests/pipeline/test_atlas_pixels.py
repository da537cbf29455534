"""What the pages hold is, bit for bit, what was rendered."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.atlas.encode import Alpha, BlendSpace, encode_frame
from fire_atlas.core.picture import as_light, to_light
from fire_atlas.core.pixels import Pixels
from fire_atlas.pipeline.animation.layers import (
    Layers,
    SimulatedClip,
    compose_layers,
    layers_of,
)
from fire_atlas.recipe.models import Recipe
from tests.support.repo import Repo, pages

LAYOUTS = [("packed", "frame"), ("packed", "animation"), ("packed", "none"), ("grid", "frame"),
           ("grid", "animation"), ("grid", "none")]  # fmt: skip


@pytest.fixture
def rendered(monkeypatch: pytest.MonkeyPatch) -> dict[int, Pixels]:
    """Return what the builds of this test compose, by frame, in light."""
    frames: dict[int, Pixels] = {}

    def watched(i: int, simulated: SimulatedClip, recipe: Recipe) -> Layers:
        parts = layers_of(i, simulated, recipe)
        flame = parts.flame.copy() if parts.flame.dtype == np.float32 else to_light(parts.flame)
        frames[i] = as_light(compose_layers(replace(parts, flame=flame), recipe, None))
        return parts

    monkeypatch.setattr("fire_atlas.pipeline.animation.render.layers_of", watched)
    return frames


def uncut(region: dict[str, Any], page: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Cut a frame out of its page and lay it where it was before it was trimmed."""
    whole = np.zeros((region["sourceSize"]["h"], region["sourceSize"]["w"], 4), np.uint8)
    at, trim = region["frame"], region["spriteSourceSize"]
    part = page[at["y"] : at["y"] + at["h"], at["x"] : at["x"] + at["w"]]
    assert part.shape[:2] == (at["h"], at["w"]), "the region lies on the page"
    whole[trim["y"] : trim["y"] + trim["h"], trim["x"] : trim["x"] + trim["w"]] = part
    return whole


def assert_pages_hold(
    repo: Repo, rendered: dict[int, Pixels], alpha: Alpha, blend_space: BlendSpace
) -> None:
    found = {}
    for page, picture in pages(repo.build, "fire"):
        assert [page["meta"]["size"][side] for side in "wh"] == [*picture.shape[1::-1]]
        for name, region in page["frames"].items():
            found[int(name.removeprefix("fire/"))] = uncut(region, picture)
    assert sorted(found) == sorted(rendered)
    for i, pixels in rendered.items():
        wanted = encode_frame(pixels, alpha, blend_space)
        assert np.array_equal(found[i], wanted), f"frame {i}"


@pytest.mark.parametrize(("layout", "trim"), LAYOUTS)
@pytest.mark.parametrize("max_size", [4096, 100])
def test_every_frame_cut_out_of_the_pages_is_the_composed_one(
    repo: Repo, rendered: dict[int, Pixels], layout: str, trim: str, max_size: int
) -> None:
    repo.clip()
    atlas = {"layout": layout, "trim": trim, "max_size": max_size}
    files = repo.built(repo.recipe(atlas=atlas))
    assert ("fire-1.png" in files) == (max_size == 100), "small pages make several"
    assert_pages_hold(repo, rendered, "straight", "srgb")


@pytest.mark.parametrize("alpha", ["straight", "premultiplied", "additive"])
@pytest.mark.parametrize("blend_space", ["srgb", "linear"])
def test_every_encoding_reaches_the_page_unchanged(
    repo: Repo, rendered: dict[int, Pixels], alpha: Alpha, blend_space: BlendSpace
) -> None:
    repo.clip(count=3)
    atlas: dict[str, str] = {"alpha": alpha, "blend_space": blend_space}
    atlas |= {"cover": "full"} if alpha == "premultiplied" else {}
    repo.built(repo.recipe(atlas=atlas))
    assert_pages_hold(repo, rendered, alpha, blend_space)


def test_regions_never_overlap_and_keep_their_padding(repo: Repo) -> None:
    repo.clip()
    repo.built(repo.recipe(atlas={"padding": 3, "max_size": 100}))
    for page, picture in pages(repo.build, "fire"):
        owner = np.zeros(picture.shape[:2], np.uint8)
        for region in page["frames"].values():
            at = region["frame"]
            around = owner[
                max(at["y"] - 3, 0) : at["y"] + at["h"] + 3,
                max(at["x"] - 3, 0) : at["x"] + at["w"] + 3,
            ]
            assert not around.any()
            owner[at["y"] : at["y"] + at["h"], at["x"] : at["x"] + at["w"]] = 1
        assert not picture[owner == 0].any(), "nothing lies between the regions"


def test_frames_and_durations_are_written_in_playing_order(repo: Repo) -> None:
    repo.clip(count=11)
    repo.built(
        repo.recipe(
            source={"path": "clip", "fps": 12.5}, timeline={"loop": "none"}, atlas={"max_size": 100}
        )
    )
    played = [page["animations"]["fire"] for page, _ in pages(repo.build, "fire")]
    assert len(played) > 1 and all(names == sorted(names) for names in played)
    assert sorted(name for names in played for name in names) == [f"fire/{i:04}" for i in range(11)]
    for page, _ in pages(repo.build, "fire"):
        assert all(region["duration"] == 80 for region in page["frames"].values())
