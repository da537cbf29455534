"""Same recipe, same inputs, same versions: same bytes, whatever else is different."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from fire_atlas.core.cpu import cpu_class
from fire_atlas.core.shipped import shipped
from tests.support.repo import Ran, Repo, command, contents, copy_of, run_alone, script

KEYS: dict[str, Any] = {
    "atlas": {"max_size": 100},
    "tracks": ["json", "csv", "pcache", "hjson", "light"],
    "seed": 3,
}

WITHOUT_AVX512 = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Haswell",
    "OPENCV_IPP": "avx2",
}
AS_AN_OLDER_CPU = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4",
    "OPENBLAS_CORETYPE": "Nehalem",
    "OPENCV_CPU_DISABLE": "AVX2,FMA3",
    "OPENCV_IPP": "sse42",
}
"""The libraries' own switches that turn instruction sets off."""


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing(repo: Repo) -> None:
    repo.clip(count=12)
    recipe = repo.recipe(**KEYS)
    one = repo.built(recipe, "--jobs", "1")
    assert "fire-1.png" in one
    for jobs in ("2", "7"):
        assert repo.built(recipe, "--force", "--jobs", jobs) == one


def test_the_order_in_which_files_were_made_and_the_folder_change_nothing(tmp_path: Path) -> None:
    results = []
    for shuffle, place in enumerate(["here", "elsewhere/with a space", "früh"]):
        repo = Repo(tmp_path / place / "repo")
        repo.clip(shuffle=shuffle)
        results.append(repo.built(repo.recipe(**KEYS)))
    assert results[0] == results[1] == results[2]


def test_the_folder_of_the_outputs_changes_nothing(repo: Repo) -> None:
    repo.clip()
    recipe = repo.recipe(**KEYS)
    here = repo.built(recipe)
    assert repo.run("build", recipe, "-o", repo.folder / "far" / "away").code == 0
    assert contents(repo.folder / "far" / "away") == here


def test_the_folder_a_build_is_started_in_changes_nothing(
    repo: Repo, monkeypatch: pytest.MonkeyPatch
) -> None:
    repo.clip()
    repo.recipe(**KEYS)
    away = repo.built(repo.folder / "fire.yaml")
    monkeypatch.chdir(repo.folder)
    assert repo.built(Path("fire.yaml"), "--force") == away


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {"LC_ALL": "tr_TR.UTF-8", "LANG": "tr_TR.UTF-8", "TZ": "Pacific/Kiritimati"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "TZ": "America/St_Johns", "PYTHONHASHSEED": "1"},
        {"PYTHONHASHSEED": "424242", "PYTHONOPTIMIZE": "1", "OMP_NUM_THREADS": "1"},
    ],
    ids=["turkish", "ascii", "hash seed"],
)
def test_the_environment_changes_nothing(repo: Repo, changes: dict[str, str]) -> None:
    repo.clip()
    recipe = repo.recipe(**KEYS)
    here = repo.built(recipe)
    ran = run_alone(command("build", recipe, "--force"), **changes)
    assert ran.code == 0, ran.err
    assert contents(repo.build) == here


@pytest.mark.slow
def test_the_zlib_inside_python_changes_nothing(repo: Repo) -> None:
    """That of Windows and of some Linux is zlib-ng, which compresses otherwise."""
    repo.clip()
    recipe = repo.recipe(movies=["apng"], **KEYS)
    here = repo.built(recipe)
    another = "import sys; from zlib_ng import zlib_ng; sys.modules['zlib'] = zlib_ng"
    ran = run_alone(script(another, "build", recipe, "--force"))
    assert ran.code == 0, ran.err
    assert contents(repo.build) == here


@pytest.mark.slow
def test_two_fresh_processes_write_the_same_manifest(tmp_path: Path) -> None:
    manifests = []
    for place in ("one", "two"):
        copy_of(shipped("recipes"), tmp_path / place / "recipes")
        copy_of(shipped("samples"), tmp_path / place / "samples")
        recipe = tmp_path / place / "recipes" / "campfire.yaml"
        small = ("--set", "source.count=8", "--set", "source.height=96")
        ran = run_alone(command("build", recipe, *small))
        assert ran.code == 0, ran.err
        manifests.append(contents(recipe.parent / "build")["campfire.manifest.json"])
    assert manifests[0] == manifests[1]
    manifest = json.loads(manifests[0])
    assert manifest["inputs"][0]["path"] == "../samples/campfire/0000.png"
    assert str(tmp_path) not in manifests[0].decode(), "no path of this machine"


@dataclass(frozen=True, slots=True)
class BuiltOnce:
    """Recipes that pass through every library's numeric kernels, built once."""

    recipes: tuple[Path, ...]
    folder: Path
    files: dict[str, bytes]

    def built_by(self, line: list[str], switches: dict[str, str]) -> dict[str, bytes]:
        ran = run_alone([*line, "--force", "-q"], **switches)
        assert ran == Ran(0, "", "")
        return contents(self.folder)


@pytest.fixture(scope="module")
def built_once(tmp_path_factory: pytest.TempPathFactory) -> BuiltOnce:
    if cpu_class() != "x86-64-v3":
        pytest.skip("nothing is promised of older CPUs and of other architectures")
    repo = Repo(tmp_path_factory.mktemp("kernels") / "repo")
    repo.clip(count=8, height=120)
    silk = {"kind": "silk", "width": 64, "height": 96, "rows": 8, "columns": 6}
    # Unity's tracks are float32: they have digits that others round away.
    every_digit: dict[str, Any] = {"exports": ["json", "unity"], "seed": 3}
    recipes = (
        repo.recipe("fire.yaml", **every_digit),
        repo.recipe("silk.yaml", source=silk, timeline={"frames": 6}, **every_digit),
    )
    ran = run_alone(command("build", *recipes))
    assert ran.code == 0, ran.err
    return BuiltOnce(recipes, repo.build, contents(repo.build))


@pytest.mark.slow
@pytest.mark.parametrize(
    "switches", [{name: value} for name, value in AS_AN_OLDER_CPU.items()], ids=" ".join
)
def test_switches_of_instruction_sets_change_nothing(
    built_once: BuiltOnce, switches: dict[str, str]
) -> None:
    assert built_once.built_by(command("build", *built_once.recipes), switches) == built_once.files


@pytest.mark.slow
def test_a_cpu_without_avx512_gives_the_same_bytes(built_once: BuiltOnce) -> None:
    """Libraries that are imported first are held to AVX2 by their own switches alone."""
    line = script("import cv2, numpy, scipy.linalg", "build", *built_once.recipes)
    assert built_once.built_by(line, WITHOUT_AVX512) == built_once.files


def test_another_seed_gives_other_flakes_and_the_same_flame(repo: Repo) -> None:
    repo.clip()
    first = repo.built(repo.recipe("a.yaml"), "--set", "seed=1")
    second = repo.built(repo.recipe("b.yaml"), "--set", "seed=2")
    assert first["a.flakes.json"].replace(b'"a"', b'"b"') != second["b.flakes.json"]
    bare = [
        repo.built(repo.recipe(f"{seed}.yaml"), "--set", f"seed={seed}", "--set", "flakes=none")
        for seed in (1, 2)
    ]
    assert bare[0]["1.png"] == bare[1]["2.png"]
