"""Make the pictures of docs/cookbook.md: ``python -m tools.cookbook`` builds each of its recipes.

A job about pages shows the first page; any other its first animation.
"""

import io
import os
import re
import tempfile
from pathlib import Path

import yaml
from PIL import Image

from fire_atlas.cli import main
from tests.support.docs_project import made_small, make_project, recipes_named, whole_recipe

DOCS = Path(__file__).parents[1] / "docs"

_JOB = re.compile(
    r"^### (?P<title>.+?)\n\n.+?```yaml\n(?P<recipe>.+?)```", re.MULTILINE | re.DOTALL
)
_HEIGHT, _FRAMES = 112, 12
_WIDEST = 360
_GROUND = (16, 16, 20)


def draw() -> None:
    """Write each picture that the page shows after the recipe of a job."""
    text = (DOCS / "cookbook.md").read_text(encoding="utf-8")
    pages = text.index("\n## Pages"), text.index("\n## Engines")
    target = DOCS / "cookbook"
    target.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        make_project(Path(folder))
        for job in _JOB.finditer(text):
            name = re.sub(r"[^a-z0-9]+", "-", job["title"].lower()).strip("-")
            if f"(cookbook/{name}.webp)" not in text:
                continue
            shows_page = pages[0] < job.start() < pages[1] or "kind: sprites" in job["recipe"]
            (target / f"{name}.webp").write_bytes(_picture(job["recipe"], shows_page))
            print(name)


def _picture(recipe: str, shows_page: bool) -> bytes:
    """Build a recipe and return a WebP of it."""
    for name in recipes_named(recipe):
        assert main(["init", name, "-q"]) == 0
    keys = whole_recipe(yaml.safe_load(recipe))
    Path("fire.yaml").write_text(yaml.safe_dump(keys))
    small = made_small(keys, _HEIGHT, keys.get("timeline", {}).get("frames", 2 * _FRAMES))
    assert main(["build", "fire.yaml", "--force", "--overwrite", "-q", *small]) == 0
    if not shows_page:
        line = ["preview", "build/fire.json", "--webp", "-o", "fire.webp", "--overwrite", "-q"]
        assert main([*line, "--background", "#{:02x}{:02x}{:02x}".format(*_GROUND)]) == 0
        with Image.open("fire.webp") as movie:
            return _reduced(movie)
    page = Image.open("build/fire.png").convert("RGBA")
    page.thumbnail((_WIDEST, _WIDEST))
    shown = Image.alpha_composite(Image.new("RGBA", page.size, (*_GROUND, 255)), page)
    data = io.BytesIO()
    shown.convert("RGB").save(data, "webp", quality=80)
    return data.getvalue()


def _reduced(movie: Image.Image) -> bytes:
    """Return an animation as a small WebP of few frames, that plays as long."""
    count = getattr(movie, "n_frames", 1)
    step = -(-count // _FRAMES)
    frames, lasting = list[Image.Image](), list[int]()
    for i in range(count):
        movie.seek(i)
        movie.load()
        if i % step == 0:
            frames.append(movie.convert("RGB"))
            frames[-1].thumbnail((_WIDEST, _HEIGHT))
            lasting.append(0)
        lasting[-1] += round(movie.info["duration"])
    data = io.BytesIO()
    frames[0].save(
        data, "webp", save_all=True, append_images=frames[1:], duration=lasting, loop=0,
        quality=50, method=6,
    )  # fmt: skip
    return data.getvalue()


if __name__ == "__main__":
    draw()
