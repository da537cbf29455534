"""The package for Unity: files and metas; its scripts, compiled against stubs and run by Mono."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from fire_atlas.cli import main
from fire_atlas.effect.composition.light import ClipLight, FrameLight
from fire_atlas.engines.unity.names import player_name
from fire_atlas.engines.unity.package import (
    FLAKES,
    FLAKES_SHADER,
    HEAT,
    HEAT_SHADER,
    PACKAGE_NAME,
    PLAYER,
    SPRITE_SHADER,
    package_files,
)
from fire_atlas.formats.product import Product
from fire_atlas.formats.tracks.light import write_light
from tests.engines.unity.products import ALONE, SEVERAL, Fire, exported
from tests.engines.unity.type_trees import Loader, documents, faults
from tests.support.heats import built
from tests.support.repo import PACKAGE as SOURCES

CSHARP = Path(__file__).parent / "cs"

MANIFEST = "package.manifest.json"

Harness = Callable[..., list[str]]


def files_of_package() -> dict[str, str]:
    """Text of each file, by its path in the package."""
    return {
        f"{folder}/{file.name}".lstrip("/"): file.data.decode()
        for folder, files in package_files(MANIFEST).items()
        for file in files
    }


def guids_of_package() -> dict[str, str]:
    """File or folder of the package with each GUID."""
    metas = {path: text for path, text in files_of_package().items() if path.endswith(".meta")}
    found = {yaml.load(text, Loader)["guid"]: path[:-5] for path, text in metas.items()}
    assert len(found) == len(metas)
    return found


@pytest.fixture(scope="module")
def harness(mono: None, tmp_path_factory: pytest.TempPathFactory) -> Harness:
    """Run the compiled package with arguments; return the lines that it prints."""
    folder = tmp_path_factory.mktemp("package")
    scripts = []
    for path, text in files_of_package().items():
        if path.endswith(".cs"):
            scripts.append(folder / Path(path).name)
            scripts[-1].write_text(text, encoding="utf-8")
    stubs = [
        CSHARP / name for name in ("Stubs.cs", "EditorStubs.cs", "Private.cs", "PackageHarness.cs")
    ]
    program = folder / "package.exe"
    command = ["mcs", "-langversion:7.2", "-warn:4", "-warnaserror", f"-out:{program}"]
    done = subprocess.run(
        [*map(str, [*command, *scripts, *stubs])], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr

    runtime = str(shutil.which("mono"))

    def run(*arguments: object, cwd: Path | None = None, path: str | None = None) -> list[str]:
        env = {**os.environ, "PATH": os.environ["PATH"] if path is None else path}
        ran = subprocess.run(
            [runtime, str(program), *map(str, arguments)],
            capture_output=True, text=True, check=True, timeout=120, cwd=cwd, env=env,
        )  # fmt: skip
        return ran.stdout.splitlines()

    return run


def lit(animation: str, *, loop: bool = True) -> ClipLight:
    """Three frames of light that differ in everything."""
    sums = [([4, 2, 1], 30, 50), ([8, 2, 0], 60, 90), ([2, 2, 2], 10, 20)]
    frames = (FrameLight(np.array(rgb, float), x, y, 0) for rgb, x, y in sums)
    return ClipLight(12, 60, 60, loop, tuple(frames))


def with_light(fire: Fire, **atlas: Any) -> Product:
    product = fire.product(**atlas)
    return replace(product, lights={name: lit(name) for name in fire.animations})


def test_every_file_has_a_meta_that_the_editor_knows() -> None:
    files = files_of_package()
    metas = {path for path in files if path.endswith(".meta")}
    folders = {path.rpartition("/")[0] for path in files} - {""}
    own = {f"{folder}/{MANIFEST}".lstrip("/") for folder in ("", *folders)}
    assert {path[:-5] for path in metas} == (files.keys() - metas) | folders | own
    assert [fault for path in metas for fault in faults(path, files[path])] == []
    assert len(guids_of_package()) == len(metas)


def test_the_package_is_one_that_the_editor_lists() -> None:
    files = files_of_package()
    package = json.loads(files["package.json"])
    assert package["name"] == PACKAGE_NAME and re.fullmatch(r"[a-z0-9._-]+", PACKAGE_NAME)
    assert re.fullmatch(r"\d+\.\d+\.\d+", package["version"])
    assert re.fullmatch(r"20\d\d\.\d", package["unity"])
    game, editor = (json.loads(text) for path, text in files.items() if path.endswith(".asmdef"))
    assert (game["name"], game["includePlatforms"]) == ("FireAtlas.Runtime", [])
    assert (editor["name"], editor["includePlatforms"]) == ("FireAtlas.Editor", ["Editor"])
    scripts = {path: text for path, text in files.items() if path.endswith(".cs")}
    assert all("UnityEditor" not in text for path, text in scripts.items() if "Runtime" in path)
    for path, text in scripts.items():  # a component has to be in a file of its name
        named = re.findall(r"public (?:static|sealed) class (\w+)", text)
        assert Path(path).stem == named[0]


def test_shaders_for_both_pipelines_draw_alike() -> None:
    files = files_of_package()
    for path in (SPRITE_SHADER, FLAKES_SHADER, HEAT_SHADER):
        urp, built_in = files[path].split("    SubShader\n")[1:]
        assert '"RenderPipeline" = "UniversalPipeline"' in urp
        assert '"com.unity.render-pipelines.universal"' in urp
        assert "RenderPipeline" not in built_in
        assert ("HLSLPROGRAM" if path == HEAT_SHADER else "CGPROGRAM") in built_in
        blends = [re.findall(r"^ +Blend .*", text, re.MULTILINE) for text in (urp, built_in)]
        assert blends[0] == blends[1]
        assert files[path].count("{") == files[path].count("}")
    functions = [
        text[text.index("float soft(") : text.index("half4 shade(")]
        for text in files[FLAKES_SHADER].split("    SubShader\n")[1:]
    ]
    own = exported(ALONE.product())["fire.flakes.shader"].decode()
    assert functions[0] == functions[1] and functions[0] in own


@pytest.mark.parametrize(
    ("product", "lamp"),
    [
        (with_light(ALONE, alpha="premultiplied", scales=[1, 0.5]), True),
        (with_light(SEVERAL), True),
        (Fire({"fire": 3}, baked=True).product(alpha="additive"), False),
        (Fire({"fire": 3}, tracks=False).product(), False),
    ],
)
def test_a_build_for_the_package_refers_to_its_files(product: Product, lamp: bool) -> None:
    files = exported(product, player="package")
    assert not [name for name in files if re.search(r"\.(cs|shader|asmdef)(\.meta)?$", name)]
    package, scripts = guids_of_package(), files_of_package()
    checked = {n: d.decode() for n, d in files.items() if n.endswith((".prefab", ".mat", ".meta"))}
    assert [fault for name, text in checked.items() for fault in faults(name, text)] == []
    own = {yaml.load(text, Loader)["guid"] for name, text in checked.items() if ".meta" in name}
    built_in = {"0000000000000000f000000000000000"}
    for name, text in checked.items():
        stated = set(re.findall(r"guid: (\w+), type: \d", text))
        assert stated <= own | built_in | package.keys(), name
    used = set()
    for name in (f"{sheet.name}.prefab" for sheet in product.sheets):
        objects = {i: (c, fields) for c, i, fields in documents(files[name].decode())}
        for class_id, fields in objects.values():
            if class_id == 114:
                script = package[fields["m_Script"]["guid"]]
                used.add(script)
                serialized = [field for field in fields if not field.startswith("m_")]
                for field in serialized:
                    assert re.search(rf"\b{field} = ", scripts[script]), (script, field)
            for value in fields.values():
                if isinstance(value, dict) and value.keys() == {"fileID"}:
                    assert value["fileID"] in objects.keys() | {0}
        player = objects[11400000][1]
        assert (player["lamp"]["fileID"] in objects) == lamp
        states = [light["state"] for light in player["lights"]]
        assert len(states) == (len(product.lights) if lamp else 0)
        assert player["showFlakes"] == int(bool(product.tracks) and not product.baked)
    assert used == {PLAYER} | ({FLAKES} if product.tracks else set())
    for animation in product.lights:
        assert f"{product.stem(animation)}.light.json.meta" in files


def test_a_build_of_heat_for_the_package_has_its_player_and_shader(tmp_path: Path) -> None:
    built(tmp_path, exports=[{"unity": {"player": "package"}}])
    assert not [*tmp_path.glob("*.cs"), *tmp_path.glob("*.shader")]
    package = guids_of_package()
    prefab, material = ((tmp_path / f"fire{end}").read_text() for end in (".prefab", ".heat.mat"))
    used = re.findall(r"m_(?:Script|Shader): .*guid: (\w+)", prefab + material)
    assert {package[guid] for guid in used} == {PLAYER, HEAT, HEAT_SHADER}
    own = tmp_path / "own"
    built(own, exports=["unity"])
    scripts = (own / "fire_heat.cs").read_text(), files_of_package()[HEAT]
    pairs = zip(*(text.splitlines() for text in scripts), strict=True)
    differing = [pair for pair in pairs if pair[0] != pair[1]]
    named = ("// ", "/// ", "[", "public sealed class", "mesh = new Mesh")
    assert differing and all(line.strip().startswith(named) for pair in differing for line in pair)
    functions = [
        text[text.index("float3 OnPage") : text.index("ENDHLSL")]
        for text in ((own / "fire.heat.shader").read_text(), files_of_package()[HEAT_SHADER])
    ]
    assert functions[0] == functions[1]


def test_a_build_of_its_own_player_refers_to_nothing_of_the_package() -> None:
    files = exported(with_light(ALONE, alpha="premultiplied"))
    assert not any(guid.encode() in data for data in files.values() for guid in guids_of_package())
    assert f"{player_name('fire')}.cs" in files


def test_a_material_of_the_user_follows_to_the_other_shader_and_back() -> None:
    product = ALONE.product(alpha="premultiplied")
    first = exported(product)
    edited = first["fire.mat"].replace(b"{r: 1, g: 1,", b"{r: 1, g: 0,")
    assert edited != first["fire.mat"]
    lying = {**first, "fire.mat": edited}
    changed = exported(replace(product, existing=lying.get), player="package")
    package = guids_of_package()
    (shader,) = re.findall(rb"m_Shader: .*guid: (\w+)", changed["fire.mat"])
    assert package[shader.decode()] == SPRITE_SHADER and b"g: 0," in changed["fire.mat"]
    back = exported(replace(product, existing={**lying, **changed}.get))
    assert back["fire.mat"] == edited


def test_the_package_plays_flakes_as_a_build_does() -> None:
    """The scripts differ in names alone."""
    own = exported(ALONE.product())["fire_flakes.cs"].decode().splitlines()
    shared = files_of_package()[FLAKES].splitlines()
    differing = [pair for pair in zip(own, shared, strict=True) if pair[0] != pair[1]]
    named = ("// ", "/// ", "[", "public sealed class", "Debug.LogError(", "mesh = new Mesh")
    assert differing and all(line.strip().startswith(named) for pair in differing for line in pair)


@pytest.mark.parametrize("loop", [True, False])
def test_light_is_that_of_the_frames_and_between_them(
    harness: Harness, loop: bool, tmp_path: Path
) -> None:
    file = tmp_path / "fire.light.json"
    file.write_bytes(write_light("fire", lit("fire", loop=loop)).data)
    rows = json.loads(file.read_bytes())["frames"]
    table = np.array([[row[key] for key in ("intensity", *"rgbxy")] for row in rows])
    times = [0, 1 / 3, 0.5, 0.9, 1, 1.25, 7.5]
    shown = [list(map(float, line.split())) for line in harness("light", file, _listed(times))]
    for time, values in zip(times, shown, strict=True):
        frame = (time % 1 if loop else min(time, 1)) * 3
        whole = min(int(frame + 1e-6), 2)
        following = (whole + 1) % 3 if loop else min(whole + 1, 2)
        part = frame - whole
        expected = table[whole] * (1 - part) + table[following] * part
        np.testing.assert_allclose(values, expected, atol=2e-4 * np.abs(table).max())


def _listed(numbers: list[float]) -> str:
    return ",".join(map(repr, numbers))


def test_what_is_no_light_is_refused(harness: Harness, tmp_path: Path) -> None:
    for text in ("", "{}", '{"format": "fire-atlas/tracks", "frames": [{}]}', '["light"]', "{"):
        (tmp_path / "x").write_text(text)
        (line,) = harness("light", tmp_path / "x", "0")
        assert line.startswith("error: ") and line.endswith("a build's .light.json file")


def test_a_player_sets_flame_flakes_and_lamp(harness: Harness, tmp_path: Path) -> None:
    """Speed 2, mean intensity 3, a tint; over two rounds of a loop, then once to its end."""
    file = tmp_path / "fire.light.json"
    file.write_bytes(write_light("fire", lit("fire")).data)
    first, *lines = harness("play", file)
    assert lines.pop(5) == "flakes that turned themselves off False"
    numbers = [list(map(float, line.split())) for line in lines]
    assert first == "flakes after Reset False, tint 0.5"
    rows = json.loads(file.read_bytes())["frames"]
    start = rows[0]
    tint = (1, 0.5, 0.25)
    colour = [start[channel] * part for channel, part in zip("rgb", tint, strict=True)]
    place = [(start["x"] - 30) / 50, (54 - start["y"]) / 50]
    light = start["intensity"] * 3 * 0.5
    np.testing.assert_allclose(numbers[0], [light, *colour, *place, 0, 0], rtol=1e-4)
    np.testing.assert_allclose(numbers[4], [light, *colour, *place, 2, 0], rtol=1e-4)
    assert [line[6] for line in numbers[:5]] == [0, 0, 1, 1, 2]
    assert numbers[5] == [2, *tint, 0.5, 1]
    assert numbers[6] == pytest.approx([0, -place[0]])
    assert numbers[7] == [2, 1, 1], "finished once, and plays again"
    assert numbers[8] == [0], "collections of 20000 updates"


def test_a_player_lights_a_fire_and_puts_it_out(harness: Harness, tmp_path: Path) -> None:
    """What the Animator is told, whether it is in ``out``, the lamp, and the events so far.

    The last Animator has no such parameter.
    """
    file = tmp_path / "fire.light.json"
    file.write_bytes(write_light("fire", lit("fire")).data)
    assert harness("phases", file) == [
        "True shown bright 0 0",
        "False shown bright 0 0", "False shown bright 0 0", "False shown bright 0 0",
        "False out dark 0 1", "False out dark 0 1",
        "True out dark 0 1", "True shown dark 0 1", "True shown bright 1 1",
        "True shown bright 1 1",
        "False shown bright 1 1",
        "an Animator that begins again",
        "False out dark 1 1",
        "a fire that does not burn as it begins, and one that begins elsewhere",
        "False out dark 1 1", "False shown bright 1 1",
        "collections 0",
        "untold out bright 1 1", "untold shown bright 1 1",
    ]  # fmt: skip


def test_names_of_recipes_are_single_arguments(harness: Harness) -> None:
    names = [
        "Assets/a.fire",
        'My "fire".yaml',
        "b\\",
        "$HOME/`x`.yml",
        "x.FIRE",
        "c.yaml.meta",
        "ü",
    ]
    line, *kinds = harness("arguments", *names)
    assert shlex.split(line) == ["build", "--json", *names]
    assert kinds == ["True", "True", "False", "True", "False", "False", "False"]


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with recipes: a candle, one that is invalid, one without a prefab."""
    project = tmp_path_factory.mktemp("a game")
    folder = project / "Assets" / 'It\'s "my" $HOME é'
    folder.mkdir(parents=True)
    source = "extends: candle"
    frames = "timeline: {frames: 3}\nsource: {height: 48}\ntracks: [light]"
    (folder / "candle.fire").write_text(
        f"{source}\n{frames}\nexports: [json, unity: {{player: package}}]\n"
    )
    (folder / "wrong.fire").write_text("extends: candle\nflakes: {ratee: 3}\n")
    (folder / "plain.yaml").write_text(f"{source}\n{frames}\n")
    tool = project / "fire-atlas"
    tool.write_text(
        f'#!/bin/sh\nPYTHONPATH="{SOURCES.parent}" exec "{sys.executable}" -P -m fire_atlas "$@"\n'
    )
    tool.chmod(0o755)
    return project


def test_the_menu_builds_recipes_and_shows_advice(harness: Harness, game: Path) -> None:
    folder = next((game / "Assets").iterdir())
    inside = f"Assets/{folder.name}"
    said = harness("build", game / "fire-atlas", game, inside)
    written = {path.name for path in (folder / "build").glob("candle.*")}
    assert {"candle.prefab", "candle.mat", "candle.light.json", "candle.light.json.meta"} <= written
    assert not any(".shader" in name for name in written)
    assert any(re.match(f"log: {re.escape(inside)}/candle.fire: wrote \\d+ files", x) for x in said)
    errors = [line for line in said if line.startswith("error: ")]
    assert errors == [
        f"error: {inside}/wrong.fire:2: flakes.ratee: unknown key; did you mean flakes.rate?"
    ]
    (warning,) = (line for line in said if line.startswith("warning: "))
    assert f"{inside}/plain.yaml: was built, but has no prefab" in warning
    assert any(line.startswith("progress: 3 of 3 ") for line in said)
    assert said[-3:] == ["finished: Failed", "refresh", "locks 0"]
    again = harness("build", game / "fire-atlas", game, f"{inside}/candle.fire", "Assets/x.png")
    assert again == [f"log: {inside}/candle.fire: is up to date", "finished: Succeeded", *said[-2:]]
    every = harness("build", game / "fire-atlas", game, "")
    assert f"log: {inside}/candle.fire: is up to date" in every and errors[0] in every
    assert not any("plain.yaml" in line for line in every)


def test_recipes_are_built_on_import_if_the_preferences_say_so(
    harness: Harness, game: Path
) -> None:
    """Twice, since they are imported again during the first build."""
    tool = game / "counted"
    tool.write_text('#!/bin/sh\necho "$@" >> "$0.txt"\n')
    tool.chmod(0o755)
    said = harness("import", tool, game, "Assets/a.fire", "Assets/b.yaml", "Assets/c.png")
    assert said[:2] == ["off: running False", "on: running True"]
    assert said[2:] == ["finished: Succeeded", "refresh"] * 2 + ["locks 0"]
    assert Path(f"{tool}.txt").read_text() == "build --json Assets/a.fire\n" * 2


def test_a_missing_or_broken_program_is_explained(harness: Harness, game: Path) -> None:
    (line, locks) = harness("build", game / "not-there", game, "Assets/a.fire")
    assert line.startswith(f"error: Fire Atlas: there is no program {game / 'not-there'}.")
    assert "pip install ./fire-atlas" in line and "Preferences > Fire Atlas" in line
    assert locks == "locks 0"
    broken = game / "broken"
    broken.write_text("#!/bin/sh\necho no such module >&2\nexit 3\n")
    broken.chmod(0o755)
    assert harness("build", broken, game, "Assets/a.fire") == [
        "error: Fire Atlas: no such module", "finished: Failed", "refresh", "locks 0"
    ]  # fmt: skip
    slow = game / "slow"
    slow.write_text("#!/bin/sh\nexec sleep 60\n")
    slow.chmod(0o755)
    assert harness("stop", slow, game, "Assets/a.fire") == ["refresh", "locks 0"]


PLANTED = (
    "fire-atlas", "fire-atlas.exe", "fire-atlas.cmd", "fire-atlas.bat",
    "node_modules/.bin/fire-atlas", "node_modules/.bin/fire-atlas.exe", ".venv/bin/fire-atlas",
)  # fmt: skip
"""Programs in a project of somebody else."""


@pytest.fixture
def stranger(tmp_path: Path) -> Path:
    """A project that holds programs of the command's name."""
    project = tmp_path / "game"
    for folder in ("Assets", "ProjectSettings"):
        (project / folder).mkdir(parents=True)
    for name in PLANTED:
        write_program(project / name, tmp_path / "ran")
    return project


def write_program(path: Path, log: Path) -> None:
    """Write a program that adds its path and its arguments to ``log``."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'#!/bin/sh\necho "$0" "$@" >> \'{log}\'\n')
    path.chmod(0o755)


def test_no_program_of_a_project_runs_by_its_name(
    harness: Harness, stranger: Path, tmp_path: Path
) -> None:
    """Whatever the PATH holds, and although the editor's folder is that of the project."""
    (tmp_path / "link").symlink_to(stranger)
    beside = tmp_path / "game 2/fire-atlas"
    write_program(beside, tmp_path / "ran")
    folders = [
        "", ".", "../game", "../game 2", "node_modules/.bin", stranger, stranger / ".venv/bin",
        stranger / "node_modules/.bin", tmp_path / "link/node_modules/.bin",
        tmp_path / "tools/../game", "",
    ]  # fmt: skip
    inside = ":".join(map(str, folders))
    for name in ("fire-atlas", "fire-atlas.cmd"):
        line, locks = harness("build", name, stranger, "Assets/a.fire", cwd=stranger, path=inside)
        assert line.startswith(f"error: Fire Atlas: there is no program {name}. Install it")
        assert "or lies in the project, state its path in Preferences > Fire Atlas" in line
        assert locks == "locks 0" and not (tmp_path / "ran").exists()
    path = f"{inside}:{beside.parent}"
    said = harness("build", "fire-atlas", stranger, "Assets/a.fire", cwd=stranger, path=path)
    assert said == ["finished: Succeeded", "refresh", "locks 0"]
    assert (tmp_path / "ran").read_text() == f"{beside} build --json Assets/a.fire\n"


@pytest.mark.parametrize("written", [".venv/bin/fire-atlas", '"{}/.venv/bin/fire-atlas" '])
def test_a_program_of_a_project_runs_if_the_user_names_its_path(
    harness: Harness, stranger: Path, tmp_path: Path, written: str
) -> None:
    harness("build", written.format(stranger), stranger, "Assets/a.fire", cwd=tmp_path, path="")
    ran = f"{stranger}/.venv/bin/fire-atlas build --json Assets/a.fire\n"
    assert (tmp_path / "ran").read_text() == ran


def test_the_command_writes_the_package_into_a_project(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for folder in ("Assets/Fire", "ProjectSettings"):
        (tmp_path / folder).mkdir(parents=True)
    assert main(["plugin", "unity", str(tmp_path / "Assets/Fire")]) == 1
    assert f"did you mean fire-atlas plugin unity {tmp_path}?" in capsys.readouterr().err
    assert main(["plugin", "unity", str(tmp_path)]) == 0
    package = tmp_path / "Packages" / PACKAGE_NAME
    assert (package / "package.json").is_file()
    script = package / PLAYER
    assert {path.name for path in package.iterdir() if path.is_dir()} == {"Editor", "Runtime"}
    metas = {p for p in package.rglob("*") if p.suffix == ".meta"}
    assert {p.with_suffix("") for p in metas} == set(package.rglob("*")) - metas
    assert main(["plugin", "unity", str(tmp_path)]) == 0
    assert "up to date" in capsys.readouterr().out
    script.write_text("// mine\n")
    assert main(["plugin", "unity", str(tmp_path)]) == 1
    assert "--overwrite" in capsys.readouterr().err and script.read_text() == "// mine\n"
