"""What the pages of whole builds hide of what is behind them, and what is said of it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.cut_frames import cut_frames
from tests.support.cover import hidden_by_light
from tests.support.repo import Repo

PLAIN: dict[str, Any] = {"motion_blur": "none", "timeline": {"loop": "none"}}


def sample(name: str, **keys: Any) -> dict[str, Any]:
    return {"path": str(shipped("samples") / name), "fps": 24, "count": 4, "height": 96, **keys}


def frames(repo: Repo, name: str, atlas: dict[str, Any], **keys: Any) -> list[Bytes]:
    """The frames of a build, as stored, whole."""
    keys = {"flakes": "none", **PLAIN, **keys}
    repo.built(repo.recipe(f"{name}.yaml", atlas={"trim": "none", **atlas}, **keys))
    return list(cut_frames(read_atlas(repo.build / f"{name}.json")))


def both(repo: Repo, **keys: Any) -> list[tuple[Bytes, Bytes]]:
    """Frames with thin and with full cover."""
    atlas = {"alpha": "premultiplied"}
    thin = frames(repo, "thin", atlas, **keys)
    full = frames(repo, "full", {**atlas, "cover": "full"}, **keys)
    return list(zip(thin, full, strict=True))


def hides(light: NDArray[Any], needed: NDArray[Any]) -> NDArray[np.float64]:
    """What light (..., 3) of 255 hides that needs that coverage (...)."""
    unit, coverage = light / 255, needed / 255
    return 255 * hidden_by_light(coverage, unit @ [0.2126, 0.7152, 0.0722])


def test_light_is_stored_alike_and_hides_less_where_it_is_thin(repo: Repo) -> None:
    for thin, full in both(
        repo, source=sample("torch.gif", matte="luminance"), flakes={"rate": 100}
    ):
        assert (thin[..., :3] == full[..., :3]).all()
        assert full[..., 3].max() > 200
        assert np.abs(thin[..., 3] - hides(full[..., :3], full[..., 3])).max() <= 1.5


def test_drawn_art_hides_as_it_is_drawn(repo: Repo) -> None:
    picture = str(shipped("samples") / "cartoon_flame.png")
    source = {"path": picture, "grid": {"columns": 6, "rows": 4}, "count": 4, "fps": 12}
    for thin, full in both(repo, source=source):
        assert (thin == full).all()


def test_a_layer_alone_hides_as_little(repo: Repo) -> None:
    keys = {"source": sample("torch.gif", matte="luminance"), "flakes": {"rate": 200}}
    frames(repo, "fire", {"alpha": "premultiplied"}, **keys, maps={"flakes": True})
    page = np.asarray(Image.open(repo.build / "fire.flakes.png"))
    lit = page[page[..., :3].max(axis=2) > 20].astype(float)
    assert len(lit) and np.abs(lit[:, 3] - hides(lit[:, :3], lit[:, :3].max(axis=1))).max() <= 3


def test_an_atlas_of_thin_light_is_read_back_as_it_is_shown(repo: Repo) -> None:
    keys = {"source": sample("torch.gif", matte="luminance")}
    first = frames(repo, "first", {"alpha": "premultiplied"}, **keys)
    again = frames(repo, "again", {"alpha": "premultiplied"}, source={"path": "build/first.json"})
    for one, other in zip(first, again, strict=True):
        off = np.abs(one.astype(int) - other)
        assert off[..., :3].max() <= 2
        assert off[..., 3].max() <= 6  # the darkest steps of sRGB are coarse, of 2 at most


NOTE = "atlas.alpha: straight, the default, hides what is behind thin fire"


@pytest.mark.parametrize(
    ("keys", "is_noted"),
    [
        ({}, True),
        ({"exports": ["json", "godot"]}, True),
        ({"atlas": {"alpha": "straight"}}, False),
        ({"atlas": {"alpha": "premultiplied"}}, False),
        ({"exports": ["phaser"]}, False),
        ({"exports": ["json", "css"]}, False),
        ({"exports": ["godot"]}, False),
        ({"source": sample("campfire", matte="none")}, False),
    ],
    ids=str,
)
def test_the_default_says_what_it_hides(keys: dict[str, Any], is_noted: bool, repo: Repo) -> None:
    given = {"source": sample("campfire"), "flakes": "none", **PLAIN, **keys}
    ran = repo.run("build", repo.recipe(**given))
    assert ran.code == 0, ran.err
    assert (NOTE in ran.err) == is_noted


def test_the_json_says_which_cover_its_pages_have(repo: Repo) -> None:
    both(repo, source=sample("torch.gif", matte="luminance"))
    frames(repo, "straight", {}, source=sample("torch.gif", matte="luminance"))
    said = {name: _about(repo.build / f"{name}.json") for name in ("thin", "full", "straight")}
    assert said == {"thin": "auto", "full": "full", "straight": None}


def _about(path: Path) -> str | None:
    found: str | None = json.loads(path.read_text())["meta"]["fireAtlas"].get("cover")
    return found
