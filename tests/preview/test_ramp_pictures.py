"""The pictures of the preview page that show a fire in each ready ramp."""

import base64
import io
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.ramp_pictures import ramp_pictures
from fire_atlas.recipe.ramps import READY_RAMPS

CLIP = {"path": str(shipped("samples") / "campfire"), "fps": 24, "count": 3, "height": 96}


@pytest.mark.parametrize("atlas", [{}, {"alpha": "additive"}, {"pixels": "heat"}])
def test_the_page_shows_the_fire_in_each_ready_ramp(atlas: dict[str, str], tmp_path: Path) -> None:
    path = tmp_path / "fire.yaml"
    recipe = {"source": CLIP, "flakes": "none", "timeline": {"loop": "none"}, "atlas": atlas}
    path.write_text(yaml.safe_dump(recipe))
    assert main(["build", "-q", str(path)]) == 0
    pictures = ramp_pictures(read_atlas(tmp_path / "build" / "fire.json"))
    assert [each.ramp for each in pictures] == list(READY_RAMPS)
    brightest = {}
    for name, picture in pictures:
        pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(picture)))).astype(int)
        brightest[name] = int((pixels[..., :3] * pixels[..., 3:]).sum(axis=(0, 1)).argmax())
    wanted = {"campfire": 0, "gas": 2, "copper": 1, "poison": 1, "soul": 2, "frost": 2}
    assert brightest == {**wanted, "blackbody": 0}
    assert main(["preview", "-q", str(path)]) == 0
    (page,) = (tmp_path / "build").glob("*.html")
    html = page.read_text()
    key = "atlas" if atlas.get("pixels") == "heat" else "composite"
    assert f"<code>{key}: {{ramp: ...}}</code>" in html
    assert all(each.picture in html for each in pictures)


def test_of_an_opaque_scene_no_picture_would_be_true(tmp_path: Path) -> None:
    path = tmp_path / "fire.yaml"
    recipe = {"source": {**CLIP, "matte": "none"}, "flakes": "none", "timeline": {"loop": "none"}}
    path.write_text(yaml.safe_dump(recipe))
    assert main(["build", "-q", str(path)]) == 0
    assert ramp_pictures(read_atlas(tmp_path / "build" / "fire.json")) == []
