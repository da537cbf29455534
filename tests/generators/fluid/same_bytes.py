"""Print digests of the gas and a drawn frame of small fires, for tests in processes of their own.

The argument says whether OpenCV and numpy use AVX2: ``with-avx2`` or ``without-avx2``.
"""

import hashlib
import os
import sys


def main(sets: str) -> None:
    """Simulate and draw, and print what came of it."""
    if sets == "without-avx2":
        os.environ["OPENCV_CPU_DISABLE"] = "AVX2,FMA3,FP16"
        os.environ["NPY_DISABLE_CPU_FEATURES"] = "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"
    import cv2

    features = cv2.getCPUFeaturesLine()
    assert ("*AVX2" in features.split()) == (sets == "with-avx2"), features
    cv2.setUseOptimized(False)
    from fire_atlas.core.workers import Workers
    from fire_atlas.generators.fluid.recording import record
    from fire_atlas.generators.fluid.renderer import FluidView, fluid_camera
    from fire_atlas.generators.fluid.scene import build_scene
    from fire_atlas.generators.fluid.volume import Volume
    from fire_atlas.generators.settings import GenerationSettings
    from fire_atlas.recipe.fluid import FluidSource
    from fire_atlas.recipe.source import Views
    from fire_atlas.recipe.wind import Wind

    for fire in ("campfire", "steam"):
        keys = {"kind": "fluid", "fire": fire, "resolution": 22, "width": 60, "height": 80}
        source = FluidSource.model_validate(keys)
        scene = build_scene(source, GenerationSettings(1, Wind(), 12, 24.0, True, Views()))
        with Workers(1) as workers:
            volumes: list[Volume] = []
            record(scene, workers, volumes.append)
        view = FluidView(scene, volumes, fluid_camera(source, 0, 0), "srgb")
        gas = b"".join(volume.scalars().tobytes() for volume in volumes)
        for data in (gas, view.frame(6).tobytes()):
            print(hashlib.sha256(data).hexdigest())


if __name__ == "__main__":
    main(sys.argv[1])
