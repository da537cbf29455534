"""What stands still in a clip, as opposed to the glow around a fire."""

import numpy as np

from fire_atlas.core.pixels import Plane
from fire_atlas.vision.activity import activity
from fire_atlas.vision.still import still_things


def clip_with(steady: Plane) -> list[Plane]:
    """A flame that sways before ``steady`` light, (96, 96)."""
    y, x = np.mgrid[:96, :96]
    planes = []
    for i in range(8):
        away = np.abs(x - 48 - 9 * np.sin(i + y / 12))
        flame = np.clip(240 - 20 * away, 0, 240) * ((y > 10) & (y < 50))
        planes.append(np.maximum(flame, steady).astype(np.float32))
    return planes


def test_a_box_that_stands_still_is_found_and_a_glow_is_not() -> None:
    y, x = np.mgrid[:96, :96]
    glow = (50 * np.exp(-((x - 48) ** 2 + (y - 32) ** 2) / 500)).astype(np.float32)
    planes = clip_with(glow)
    assert still_things(planes, activity(planes)).max() == 0
    box = np.zeros((96, 96), np.float32)
    box[70:90, 20:76] = 160
    planes = clip_with(np.maximum(glow, box))
    found = still_things(planes, activity(planes))
    assert found[72:88, 22:74].min() == 1
    found[68:92, 18:78] = 0
    assert found.max() == 0
