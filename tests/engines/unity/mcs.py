"""Mono's C# compiler. What was compiled once is not compiled again: tests play the same players."""

import subprocess
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

CSHARP = Path(__file__).parent / "cs"

STUBS = (CSHARP / "Stubs.cs", CSHARP / "Private.cs")
"""What of Unity the players use."""

STRICT = ("-warn:4", "-warnaserror")
"""Options with which warnings are errors."""


def compiled(program: Path, sources: dict[str, str], *options: str) -> None:
    """Write the program that C# sources, by their names, are compiled into.

    Raises:
        AssertionError: They do not compile.
    """
    program.write_bytes(_compiled(tuple(sources.items()), options))


@cache
def _compiled(sources: tuple[tuple[str, str], ...], options: tuple[str, ...]) -> bytes:
    with TemporaryDirectory() as name:
        folder = Path(name)
        for source, text in sources:
            (folder / source).write_text(text, encoding="utf-8")
        program = folder / "program.exe"
        done = subprocess.run(
            ["mcs", "-langversion:7.2", *options, f"-out:{program}",
             *(str(folder / source) for source, _ in sources)],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        return program.read_bytes()
