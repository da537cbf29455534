"""Builds from videos: how often they are decoded, what is reduced, and how much memory it takes."""

import json
from collections import Counter
from collections.abc import Generator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.shipped import shipped
from fire_atlas.sources import video
from fire_atlas.sources.video_stream import DecodedFrame, VideoScan, decode_video
from tests.pipeline.test_memory import peak_without_pages
from tests.support import synthetic_fire
from tests.support.repo import Repo
from tests.support.synthetic_fire import write_video


def film(repo: Repo, count: int, height: int) -> Path:
    """Write a video of the sample campfire over black, played again and again."""
    files = sorted((shipped("samples") / "campfire").glob("*.png"))
    frames = [_shot(files[i % len(files)], height) for i in range(count)]
    options = {"crf": "12", "preset": "ultrafast"}
    path = repo.folder / "fire.mp4"
    return write_video(path, frames, "libx264", "yuv420p", options, rate=24)


def _shot(file: Path, height: int) -> NDArray[np.uint8]:
    """Return a frame over black, with even sides, (H, W, 4)."""
    image = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    assert image is not None
    width = 2 * round(image.shape[1] * height / image.shape[0] / 2)
    large = cv2.resize(image, (width, height)).astype(np.float32)
    rgb = large[..., 2::-1] * large[..., 3:] / 255
    return np.dstack([rgb, np.full(rgb.shape[:2], 255)]).astype(np.uint8)


def statistics(repo: Repo) -> dict[str, Any]:
    manifest: dict[str, Any] = json.loads((repo.build / "fire.manifest.json").read_bytes())
    return dict(manifest["statistics"])


@pytest.mark.parametrize(("crop", "times"), [("none", 1), ("auto", 2)])
def test_a_fire_of_many_parts_decodes_its_video_no_more_often(
    crop: str, times: int, repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    decoded = Counter[int]()

    def counting(
        path: Path, scan: VideoScan, threads: int, max_pixels: int
    ) -> Generator[DecodedFrame]:
        for i, frame in enumerate(decode_video(path, scan, threads, max_pixels)):
            decoded[i] += 1
            yield frame

    monkeypatch.setattr(video, "decode_video", counting)
    film(repo, 24, 96)
    source = {"path": "fire.mp4", "crop": crop}
    ran = repo.run("build", repo.recipe(source=source, timeline={"frames": 150}))
    assert ran.code == 0, ran.err
    assert "jumps between similar moments" in ran.out + ran.err
    assert decoded == dict.fromkeys(range(24), times)


def test_a_tall_video_is_reduced_and_the_build_says_so(repo: Repo) -> None:
    film(repo, 6, 600)
    recipe = repo.recipe(source={"path": "fire.mp4"}, timeline={"loop": "none"})
    ran = repo.run("build", recipe)
    width, height = statistics(repo)["frame_size"]
    assert height == 512
    assert f"are reduced to {width}x512; source.height: source keeps their size" in (
        ran.out + ran.err
    )
    assert repo.run("build", recipe, "--set", "source.height=source").code == 0
    assert statistics(repo)["frame_size"][1] == 600
    assert repo.run("build", recipe, "--set", "atlas.max_size=700").code == 0
    assert 256 < statistics(repo)["frame_size"][1] < 310
    assert len(statistics(repo)["pages"]) == 1


@pytest.mark.slow
def test_large_footage_takes_little_memory(repo: Repo) -> None:
    """Its 40 frames, kept whole as bytes, would take 245 MB more."""
    film(repo, 40, 1600)
    recipe = repo.recipe(source={"path": "fire.mp4"}, tracks=[], flakes={"rate": 20})
    assert peak_without_pages(repo, recipe) < 400


def test_a_drawing_that_is_held_takes_one_place_on_the_page(repo: Repo) -> None:
    drawings = synthetic_fire.fires(6, hard=True)
    synthetic_fire.write_animation(repo.folder / "fire.gif", drawings, duration=[40] * 5 + [2000])
    ran = repo.run("build", repo.recipe(source={"path": "fire.gif"}, flakes="none"))
    assert ran.code == 0, ran.err
    assert "49 only hold a drawing" in ran.out + ran.err
    frames = json.loads((repo.build / "fire.json").read_bytes())["frames"].values()
    assert len(frames) == 55
    assert len({tuple(each["frame"].values()) for each in frames}) == 6
