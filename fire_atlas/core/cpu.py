"""The class of CPU, and the same kernels on every CPU of a class.

numpy, its BLAS, OpenCV and its IPP look at the CPU when they are imported and take the kernels of
its newest instruction set. Kernels of different sets round differently in the last bits, and sort
equal keys in another order: numpy's ``exp``, powers and ``argsort`` of float64 are others with
AVX-512 than with AVX2. So all CPUs with AVX2 are made to take the kernels of AVX2.

Nothing heavy is imported here.
"""

import os
import sys
from functools import cache

_LEVEL_3 = {"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}
"""What makes an x86-64 CPU one of level 3 of its psABI (Haswell, Zen and later)."""

_SETTINGS = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Haswell",
    "OPENCV_IPP": "avx2",
}
"""What holds each library to the kernels of level 3."""


def cpu_class() -> str:
    """Return the class of this CPU: all of one class give the same bytes.

    It is ``x86-64-v3`` with AVX2, ``x86-64-v2`` without, and elsewhere the architecture's name.
    """
    if _architecture() != "x86_64":
        return _architecture()
    return "x86-64-v3" if _instruction_sets() >= _LEVEL_3 else "x86-64-v2"


def pin_kernels() -> None:
    """Hold the numeric libraries to the kernels of the CPU's class, and BLAS to one thread.

    They read the environment when they are imported, so this comes before. What a person has set
    there would change outputs; it is replaced.
    """
    # Our products are small: BLAS would spend more on waking threads, which then spin beside ours,
    # and by how many share a sum its last bits vary.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    if cpu_class() != "x86-64-v3":
        return
    os.environ.update(_SETTINGS)
    # OpenCV prints a warning for a set it is to disable that the CPU does not have.
    newer = "AVX512-SKX" if "avx512f" in _instruction_sets() else ""
    os.environ["OPENCV_CPU_DISABLE"] = newer


def _architecture() -> str:
    """Return the CPU's architecture as Linux calls it; ``platform`` takes longer to import."""
    name = os.uname().machine if hasattr(os, "uname") else os.environ["PROCESSOR_ARCHITECTURE"]
    return {"amd64": "x86_64", "arm64": "aarch64"}.get(name.lower(), name.lower())


@cache
def _instruction_sets() -> frozenset[str]:
    """Return the instruction sets of an x86-64 CPU as Linux calls them, as far as is known."""
    if sys.platform == "win32":
        return _instruction_sets_of_windows()
    if sys.platform == "darwin":
        return _instruction_sets_of_macos()
    return _instruction_sets_of_linux() if sys.platform == "linux" else frozenset()


def _instruction_sets_of_linux() -> frozenset[str]:
    from pathlib import Path  # --help does without

    with Path("/proc/cpuinfo").open(encoding="utf-8") as lines:
        flags = next((line for line in lines if line.startswith("flags")), "")
    return frozenset(flags.partition(":")[2].split())


def _instruction_sets_of_windows() -> frozenset[str]:
    """Return what Windows reports: AVX2 and AVX-512 alone. The rest of level 3 came with AVX2."""
    import ctypes

    has = ctypes.windll.kernel32.IsProcessorFeaturePresent  # type: ignore[attr-defined]
    avx2, avx512f = 40, 41  # PF_AVX2_INSTRUCTIONS_AVAILABLE, PF_AVX512F_INSTRUCTIONS_AVAILABLE
    known = _LEVEL_3 if has(avx2) else set()
    return frozenset(known | {"avx512f"} if has(avx512f) else known)


def _instruction_sets_of_macos() -> frozenset[str]:
    import subprocess

    keys = ["machdep.cpu.features", "machdep.cpu.leaf7_features"]
    report = subprocess.run(["sysctl", "-n", *keys], capture_output=True, text=True, check=False)
    return frozenset(report.stdout.lower().split())
