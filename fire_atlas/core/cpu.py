"""What CPUs there are; make numpy, OpenBLAS and OpenCV compute the same bytes on each of a class.

On import, these libraries (and the IPP in OpenCV) pick the kernels for the CPU's newest instruction
set. Kernels of different sets round the last bits differently and sort equal keys in another order:
numpy's ``exp``, powers and ``argsort`` of float64 with AVX-512 differ from those with AVX2. So
every CPU with AVX2 uses the AVX2 kernels, even if it has AVX-512.

This module runs before numpy is imported, and must not import it.
"""

import os
import sys
from functools import cache

_LEVEL_3 = {"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}
"""Instruction sets of a CPU of level x86-64-v3 (x86-64 psABI): Intel Haswell, AMD Zen and later."""

_SETTINGS = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Haswell",
    "OPENCV_IPP": "avx2",
}
"""Environment variables that restrict each library to the kernels of level x86-64-v3."""


def default_jobs() -> int:
    """Return the default number of workers: the number of CPUs that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def cpu_class() -> str:
    """Return the class of this CPU. All CPUs of one class compute the same bytes.

    It is ``x86-64-v3`` (with AVX2), ``x86-64-v2``, or the name of another architecture.
    """
    if _architecture() != "x86_64":
        return _architecture()
    return "x86-64-v3" if _instruction_sets() >= _LEVEL_3 else "x86-64-v2"


def pin_kernels() -> None:
    """Restrict the numeric libraries to the kernels of the CPU's class, and BLAS to one thread.

    Call it before they are imported: that is when they read these environment variables. Values
    set by the user are replaced, as they would change the outputs.
    """
    # Our matrices are small: waking BLAS threads takes longer than the product, and the last bits
    # of a sum depend on the number of threads that share it.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    if cpu_class() != "x86-64-v3":
        return
    os.environ.update(_SETTINGS)
    # OpenCV prints a warning if it is to disable an instruction set that the CPU does not have.
    newer = "AVX512-SKX" if "avx512f" in _instruction_sets() else ""
    os.environ["OPENCV_CPU_DISABLE"] = newer


def _architecture() -> str:
    """Return Linux's name of the CPU's architecture. The module ``platform`` is slow to import."""
    name = os.uname().machine if hasattr(os, "uname") else os.environ["PROCESSOR_ARCHITECTURE"]
    return {"amd64": "x86_64", "arm64": "aarch64"}.get(name.lower(), name.lower())


@cache
def _instruction_sets() -> frozenset[str]:
    """Return Linux's names of the CPU's instruction sets; none where the system cannot be asked."""
    if sys.platform == "win32":
        return _instruction_sets_of_windows()
    if sys.platform == "darwin":
        return _instruction_sets_of_macos()
    return _instruction_sets_of_linux() if sys.platform == "linux" else frozenset()


def _instruction_sets_of_linux() -> frozenset[str]:
    from pathlib import Path  # slow to import, and --help does not need it

    with Path("/proc/cpuinfo").open(encoding="utf-8") as lines:
        flags = next((line for line in lines if line.startswith("flags")), "")
    return frozenset(flags.partition(":")[2].split())


def _instruction_sets_of_windows() -> frozenset[str]:
    """Windows reports only AVX2 and AVX-512; a CPU with AVX2 has the rest of level 3 too."""
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
