"""Preview pages, opened in a real browser."""

import base64
import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path
from threading import Timer
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.shipped import shipped
from tests.support.requirements import node_modules

_HERE = Path(__file__).parent

_SECONDS = 120
"""Maximum length of a visit."""

_WATCH = """new Promise((done) => {
  const seen = [];
  new MutationObserver(() => {
    const caption = document.getElementById("caption").textContent;
    const time = document.timeline.currentTime;
    seen.push([time, Number(document.getElementById("now").textContent), caption]);
    const passed = time - seen[0][0];
    if (UNTIL) done(seen);
  }).observe(document.getElementById("caption"), {childList: true});
})"""

OPEN_DETAILS = "click", "#details summary"
"""A step that unfolds what is for experts."""

COUNT = 6
"""Frames of what is built if a test asks for no other number."""


@dataclass(frozen=True)
class Seen:
    """What a visit to a page gave: results of its steps, errors, and addresses asked for."""

    results: list[Any]
    errors: list[str]
    requests: list[str]


class Browser:
    """A browser that is open for many visits, all in one profile: pages store nothing."""

    def __init__(self, node: str) -> None:
        named = {"FIRE_ATLAS_NODE_MODULES": str(node_modules())}
        self._driver = subprocess.Popen(
            [node, _HERE / "drive.mjs"], env={**os.environ, **named},
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8",
        )  # fmt: skip

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._driver.communicate(timeout=_SECONDS)  # at the end of its input it closes the browser

    def visit(
        self,
        page: Path,
        *steps: tuple[Any, ...],
        moves: bool = False,
        size: tuple[int, int] = (1200, 800),
    ) -> Seen:
        """Open ``page``, take ``steps`` (see ``drive.mjs``) and return what was seen."""
        visit = {"file": str(page), "width": size[0], "height": size[1], "moves": moves}
        assert self._driver.stdin and self._driver.stdout
        watchdog = Timer(_SECONDS, self._driver.kill)
        watchdog.start()
        try:
            print(json.dumps({**visit, "steps": steps}), file=self._driver.stdin, flush=True)
            answer = json.loads(self._driver.stdout.readline() or '{"failed": "no answer"}')
        finally:
            watchdog.cancel()
        assert "failed" not in answer, answer["failed"]
        return Seen(**answer)


def picture(result: dict[str, Any]) -> Bytes:
    """Return the pixels of a canvas (H, W, 4) uint8."""
    width, height = result["size"]
    return np.frombuffer(base64.b64decode(result["rgba"]), np.uint8).reshape(height, width, 4)


def watch(until: str) -> tuple[str, str]:
    """Return a step that gives all that a page tells as it plays: [its time in ms, frame, caption].

    It ends as soon as ``until`` holds, a condition in JavaScript of the ms that have ``passed``, of
    the ``caption``, and of all that was ``seen``.
    """
    return "run", _WATCH.replace("UNTIL", until)


def off_time(
    frames: NDArray[np.int64], times: NDArray[np.float64], each: float, total: int
) -> NDArray[np.float64]:
    """Return how far ``frames`` (n,) are from where ``times`` (n,) in ms lead from the first one.

    Frames last ``each`` ms and come again after ``total``. On a busy machine a browser leaves
    frames out, but those that it shows are less than one from there (times are rounded to 0.1 ms).
    """
    off: NDArray[np.float64] = frames - frames[0] - (times - times[0]) / each
    off -= np.round(off / total) * total
    return off


def built(folder: Path, *preview: str, count: int = COUNT, **keys: Any) -> Path:
    """Build an effect of some frames of the sample campfire; return its preview page."""
    source = {"path": str(shipped("samples") / "campfire"), "fps": 24, "count": count, "height": 96}
    recipe = folder / "fire.yaml"
    recipe.write_text(json.dumps({"source": source, "flakes": {"rate": 300}, **keys}))
    assert main(["build", str(recipe), "-q"]) == 0
    return previewed(folder / "build" / "fire.json", *preview)


def painted(folder: Path, *frames: Bytes, **keys: Any) -> Path:
    """Build an effect of pictures (H, W, 4) that play once; return its preview page."""
    (folder / "clip").mkdir()
    for i, frame in enumerate(frames):
        Image.fromarray(frame).save(folder / "clip" / f"{i:04}.png")
    recipe = {
        "source": {"path": "clip", "fps": 12}, "flakes": "none", "motion_blur": "none",
        "timeline": {"loop": "none"}, **keys,
    }  # fmt: skip
    (folder / "fire.yaml").write_text(json.dumps(recipe))
    assert main(["build", str(folder / "fire.yaml"), "-q"]) == 0
    return previewed(folder / "build" / "fire.json")


def previewed(atlas: Path, *preview: str) -> Path:
    assert main(["preview", str(atlas), "-q", *preview]) == 0
    return atlas.with_name(f"{atlas.stem}.preview.html")


def assert_quiet(seen: Seen, page: Path) -> None:
    """Nothing went wrong, and nothing was asked of anyone but the page itself."""
    assert seen.errors == []
    elsewhere = [url for url in seen.requests if not url.startswith(("data:", "blob:"))]
    assert elsewhere == [page.as_uri()]
