"""Godot 4 loads compressed textures of a build as they are, without its importer."""

import base64
import io
import shutil
from pathlib import Path

import numpy as np
import texture2ddecoder
from PIL import Image

from tests.support.godot4 import Godot4
from tests.support.repo import Repo

SCRIPT = """\
extends Node
func answer(job: Dictionary) -> Array:
	var image: Image = load(job["path"]).get_image()
	var levels := image.get_mipmap_count()
	if image.is_compressed():
		image.decompress()
	image.clear_mipmaps()
	image.convert(Image.FORMAT_RGBA8)
	return [levels, Marshalls.raw_to_base64(image.save_png_to_buffer())]
"""


def test_godot_loads_dds_and_ktx2_with_all_levels_and_with_one(
    godot4: Godot4, tmp_path: Path
) -> None:
    repo, project = Repo(tmp_path / "repo"), tmp_path / "project"
    repo.clip()
    project.mkdir()
    (project / "read.gd").write_text(SCRIPT, encoding="utf-8")
    jobs = []
    for mips, packing in ((1, "none"), (15, "none"), (1, "zstd"), (15, "zstd")):
        atlas = {"gpu": ["bc7.dds", "bc7.ktx2"], "mips": mips, "alpha": "premultiplied",
                 "supercompression": packing}  # fmt: skip
        repo.built(repo.recipe(atlas=atlas))
        for kind in ("dds", "ktx2"):
            name = f"fire{mips}{packing}.{kind}"
            shutil.copy(repo.build / f"fire.bc7.{kind}", project / name)
            jobs.append({"do": "ask", "script": "res://read.gd", "path": f"res://{name}"})
    for job, (levels, png) in zip(jobs, godot4.run(project, jobs), strict=True):
        with Image.open(io.BytesIO(base64.b64decode(png))) as opened:
            seen = np.asarray(opened.convert("RGBA"))
        height, width = seen.shape[:2]
        assert levels == (max(width, height).bit_length() - 1 if "15" in job["path"] else 0)
        # Both files hold the same blocks; the first level comes first in DDS.
        blocks = (project / job["path"][6:]).with_suffix(".dds").read_bytes()[148:]
        decoded = texture2ddecoder.decode_bc7(blocks[: width * height], width, height)
        pixels = np.frombuffer(decoded, np.uint8).reshape(height, width, 4)[..., [2, 1, 0, 3]]
        assert np.array_equal(seen, pixels)
