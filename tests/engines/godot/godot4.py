"""Godot 4 text, as far as it is written here, in the syntax of Godot 3, which runs everywhere.

Nothing is lost on the way but what Godot 3 does not know: uids, and how long each frame lasts.
"""

import re
from pathlib import Path

_WORDS = {
    "Texture2D": "Texture", "AnimatedSprite2D": "AnimatedSprite", "sprite_frames": "frames",
    "PackedStringArray": "PoolStringArray", "PackedInt32Array": "PoolIntArray",
    "PackedFloat32Array": "PoolRealArray", "PackedColorArray": "PoolColorArray",
    "PackedVector2Array": "PoolVector2Array", "PointLight2D": "Light2D",
}  # fmt: skip

_SCRIPT = {
    "@export": "export", "@onready": "onready", "RenderingServer": "VisualServer",
    "multimesh.use_custom_data = true":
        "multimesh.custom_data_format = MultiMesh.CUSTOM_DATA_FLOAT",
    "_sprite.frame + _sprite.frame_progress": "_sprite.frame", ".lerp(": ".linear_interpolate(",
}  # fmt: skip


def durations(text: str) -> list[float]:
    """Return how many ticks each frame of a SpriteFrames text lasts, in the order it has them."""
    return [float(ticks) for ticks in re.findall(r'^"duration": ([0-9.]+),$', text, re.MULTILINE)]


def as_godot_3(folder: Path) -> None:
    """Rewrite the resources, scenes and scripts of a folder."""
    for path in folder.iterdir():
        text = path.read_text(encoding="utf-8") if path.suffix in (".tres", ".tscn", ".gd") else ""
        if path.suffix == ".gd":
            path.write_text(_replaced(text, _SCRIPT | _WORDS), encoding="utf-8")
        elif text:
            path.write_text(_resource(text), encoding="utf-8")
        elif path.name.endswith((".import", ".uid")):
            path.unlink()


def _resource(text: str) -> str:
    # A texture that Godot 3 does not have; a lamp without one shines on nothing.
    text = re.sub(r'\[sub_resource type="GradientTexture2D"[^\[]*', "", text)
    text = re.sub(r"^texture = SubResource\(.*\n(?=texture_scale)", "", text, flags=re.M)
    text = re.sub(r' uid="uid://[a-y0-8]+"', "", text).replace("format=3", "format=2")
    text = re.sub(r'^(\[(?:ext|sub)_resource .*)id="(\d+)"\]', r"\1id=\2]", text, flags=re.M)
    text = re.sub(r'(ExtResource|SubResource)\("(\d+)"\)', r"\1( \2 )", text)
    text = re.sub(r'\{\n"duration": [0-9.]+,\n"texture": (.*)\n\}', r"\1", text)
    text = re.sub(r'^autoplay = ".*"$', "playing = true", text, flags=re.M)
    return _replaced(text.replace('&"', '"'), _WORDS)


def _replaced(text: str, words: dict[str, str]) -> str:
    for word, other in words.items():
        text = text.replace(word, other)
    return text
