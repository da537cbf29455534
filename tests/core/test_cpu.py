"""The class of CPU, and what the libraries are held to."""

import os

import cv2
import numpy as np
import pytest

from fire_atlas.core import cpu
from fire_atlas.core.cpu import cpu_class, pin_kernels

on_level_3 = pytest.mark.skipif(cpu_class() != "x86-64-v3", reason="older, or not x86-64")


def test_the_class_is_the_level_that_numpy_finds() -> None:
    found = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
    assert (cpu_class() == "x86-64-v3") == ("X86_V3" in found)


@on_level_3
def test_numpy_and_opencv_use_nothing_newer_than_avx2() -> None:
    found = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
    assert not {"X86_V4", "AVX512_ICL", "AVX512_SPR"} & set(found)
    assert "AVX2" in cv2.getCPUFeaturesLine()
    assert "AVX512-SKX " not in f"{cv2.getCPUFeaturesLine()} "


@on_level_3
def test_what_the_environment_says_of_kernels_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_CORETYPE", "SkylakeX")
    monkeypatch.setenv("OPENCV_IPP", "disabled")
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "8")
    pin_kernels()
    assert os.environ["OPENBLAS_CORETYPE"] == "Haswell"
    assert os.environ["OPENCV_IPP"] == "avx2"
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"


@on_level_3
def test_an_older_cpu_is_of_another_class_and_asked_for_nothing_it_has_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(cpu, "_instruction_sets", lambda: frozenset({"sse4_2", "avx"}))
    for name in ("OPENBLAS_CORETYPE", "OPENCV_IPP", "OPENCV_CPU_DISABLE"):
        monkeypatch.delenv(name)
    pin_kernels()
    assert cpu_class() == "x86-64-v2"
    assert "OPENBLAS_CORETYPE" not in os.environ  # kernels of AVX2 would crash
    assert "OPENCV_CPU_DISABLE" not in os.environ
