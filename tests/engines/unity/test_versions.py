"""The C# for Unity, compiled by Roslyn as the versions that Unity's editors speak: 7.3 and 9."""

from pathlib import Path

import pytest

from fire_atlas.engines.unity.names import player_name
from tests.engines.unity.products import Fire, exported
from tests.engines.unity.roslyn import Roslyn
from tests.engines.unity.test_package import CSHARP, files_of_package
from tests.support.heats import built


@pytest.fixture(scope="module")
def roslyn(mono: None, tmp_path_factory: pytest.TempPathFactory) -> Roslyn:
    return Roslyn(tmp_path_factory.mktemp("roslyn"))


def faults(found: list[str], scripts: list[Path]) -> list[str]:
    """Errors anywhere, and warnings about the scripts: stubs have fields that nothing sets."""
    return [
        each
        for each in found
        if ": error " in each or any(f" /{script.name}(" in each for script in scripts)
    ]


def test_package_and_players_of_builds_compile_without_a_warning(
    roslyn: Roslyn, tmp_path: Path
) -> None:
    scripts = []
    for path, text in files_of_package().items():
        if path.endswith(".cs"):
            scripts.append(tmp_path / Path(path).name)
            scripts[-1].write_text(text, encoding="utf-8")
    for name in ("fire", "class", "2nd-fire.x"):
        scripts.append(tmp_path / f"{player_name(name)}.cs")
        scripts[-1].write_bytes(exported(Fire({name: 2}, name=name).product())[scripts[-1].name])
    built(tmp_path, "hot", exports=["unity"])
    scripts.append(tmp_path / "hot_heat.cs")
    stubs = [
        CSHARP / name for name in ("Stubs.cs", "EditorStubs.cs", "Private.cs", "PackageHarness.cs")
    ]
    assert faults(roslyn.diagnostics([*scripts, *stubs]), scripts) == []


def test_the_compiler_keeps_to_the_version(roslyn: Roslyn, tmp_path: Path) -> None:
    refused_by = {
        "System.Console.Write((1, 2) == (1, 2));": [],
        "object o = 1; System.Console.Write(o is not null);": ["7.3"],
        'const string a = "a"; const string b = $"{a}"; System.Console.Write(b);': ["7.3", "9.0"],
        'int n = "text"; System.Console.Write(n);': ["7.3", "9.0"],
    }
    programs = [tmp_path / f"P{i}.cs" for i in range(len(refused_by))]
    for i, text in enumerate(refused_by):
        programs[i].write_text(f"static class P{i} {{ static void M() {{ {text} }} }}")
    main = tmp_path / "Program.cs"
    main.write_text("static class Program { static void Main() { } }")
    found = roslyn.diagnostics([*programs, main])
    for program, versions in zip(programs, refused_by.values(), strict=True):
        errors = [each for each in found if f" /{program.name}(" in each and ": error " in each]
        assert sorted({each.split()[0] for each in errors}) == versions, found
