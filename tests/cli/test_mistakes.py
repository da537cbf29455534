"""Mistakes that are easily made: one sentence each, with recipe, line and key, and the right code.

``check`` and ``build`` say the same, and neither begins to work.
"""

import shutil
from pathlib import Path

import pytest

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from tests.campaign import corpus

MISTAKES: dict[str, tuple[int, str, str]] = {
    # What is written is not YAML, or not what it seems.
    "a colour without quotes in braces": (
        2,
        "source: {path: clip}\nflakes: {colors: [#ff0000]}\n",
        "fire.yaml:3: is no valid YAML: *quote colours: an unquoted # begins a comment",
    ),
    "a comment in braces": (
        2,
        "source: {path: clip, fps: 12 # slow}\nseed: 1\n",
        "fire.yaml:2: is no valid YAML: *close the block with }, and quote colours",
    ),
    "a colour without quotes": (
        2,
        "source: {path: clip}\nflakes:\n  colors: #ff0000\n",
        "fire.yaml:3: flakes.colors: has no value; *an unquoted # begins a comment",
    ),
    "a Windows path in double quotes": (
        2,
        'source:\n  path: "C:\\clips\\fire"\n',
        "fire.yaml:2: is no valid YAML: *write paths with /",
    ),
    "a Windows path with a hexadecimal escape": (
        2,
        'source: {path: "C:\\users\\me"}\n',
        "fire.yaml:1: is no valid YAML: *write paths with /",
    ),
    "a Windows path whose escapes are valid": (
        1,
        'source: {path: "C:\\torch\\new"}\n',
        "fire.yaml:1: source.path: *write paths with /",
    ),
    "a tab": (2, "source:\n\tpath: clip\n", "fire.yaml:2: is no valid YAML: *indent with spaces"),
    "two documents": (2, "source: {path: clip}\n---\nseed: 1\n", "fire.yaml:2: a second document"),
    "a key twice": (
        2,
        "seed: 1\nsource: {path: clip}\nseed: 2\n",
        "fire.yaml:3: seed: stands here",
    ),
    "no text at all": (2, "", "fire.yaml:1: is empty"),
    "a list": (2, "- source\n", "fire.yaml:1: a recipe is made of `key: value` lines"),
    "a value left out": (2, "source: {path: clip}\nseed:\n", "fire.yaml:2: seed: has no value"),
    # Keys.
    "a misspelt key": (
        2,
        "source: {path: clip, fsp: 3}\n",
        "fire.yaml:1: source.fsp: *source.fps?",
    ),
    "a key in the wrong block": (
        2,
        "source: {path: clip}\nfps: 3\n",
        "fire.yaml:2: fps: unknown key",
    ),
    "a key of another source": (
        2,
        "source: {path: clip, slices: 3}\n",
        "fire.yaml:1: source.slices: *kind: profile",
    ),
    "a key with a dot": (
        2,
        "source: {path: clip}\nflakes.rate: 3\n",
        "fire.yaml:2: flakes.rate: *inside the block",
    ),
    "no source": (2, "seed: 1\n", "fire.yaml:1: source: is missing"),
    "no path": (2, "source: {fps: 3}\n", "fire.yaml:1: source.path: is missing"),
    "an unknown kind": (
        2,
        "source: {kind: silck}\n",
        "fire.yaml:1: source.kind: *did you mean silk?",
    ),
    "an unknown preset": (2, "extends: campfre\n", "fire.yaml:1: extends: *did you mean campfire?"),
    "a recipe to extend that is not there": (
        2,
        "extends: ./base.yaml\n",
        "fire.yaml:1: extends: there is no recipe file",
    ),
    # Values.
    "text for a number": (
        2,
        "source: {path: clip}\nflakes:\n  rate: many\n",
        "fire.yaml:3: flakes.rate: must be `auto`",
    ),
    "a number in quotes": (
        2,
        'source: {path: clip}\nseed: "1"\n',
        "fire.yaml:2: seed: must be a whole",
    ),
    "too much": (
        2,
        "source: {path: clip}\nflakes: {life: [1, 99]}\n",
        "fire.yaml:2: flakes.life.1: *at most 60",
    ),
    "a range the wrong way": (
        2,
        "source: {path: clip}\nflakes: {life: [3, 1]}\n",
        "fire.yaml:2: flakes.life: the first",
    ),
    "wind that blows up": (
        2,
        "source: {path: clip}\nwind: {level: 1, direction: up}\n",
        "fire.yaml:2: wind.direction: wind blows level: *buoyancy.lift*got up",
    ),
    "wind that blows down": (
        2,
        "source: {path: clip}\nwind:\n  level: 1\n  direction: down\n",
        "fire.yaml:4: wind.direction: wind blows level: *got down",
    ),
    "a misspelt direction": (
        2,
        "source: {path: clip}\nwind: {level: 1, direction: lefd}\n",
        "fire.yaml:2: wind.direction: must be right, left or degrees *did you mean left?",
    ),
    "gusts beyond the strongest wind": (
        2,
        "source: {path: clip}\nwind: {gusts: {mean: 4, strength: 3}}\n",
        "fire.yaml:2: wind.gusts: blow up to level 7",
    ),
    "a name that is a path": (
        2,
        "source: {path: clip}\nname: ../x\n",
        "fire.yaml:2: name: must be",
    ),
    "an unknown export": (
        2,
        "source: {path: clip}\nexports: [jsn]\n",
        "fire.yaml:2: exports.0: *json?",
    ),
    "an export twice": (
        2,
        "source: {path: clip}\nexports: [css, css]\n",
        "fire.yaml:2: exports: css is",
    ),
    "a map that needs a grid": (
        2,
        "source: {path: clip}\nmaps:\n  motion: unity\n",
        "fire.yaml:3: maps.motion: unity motion",
    ),
    "a rotated grid": (
        2,
        "source: {path: clip}\natlas: {layout: grid, rotate: true}\n",
        "fire.yaml:2: atlas.rotate: a",
    ),
    "a tail that waits for no flake": (
        2,
        "source: {path: clip}\nflakes: none\ntimeline: {tail: true, loop: none}\n",
        "fire.yaml:3: timeline.tail: waits for flakes",
    ),
    "views of a clip": (
        2,
        "source: {path: clip}\nviews: {count: 8}\n",
        "fire.yaml:2: views: frames have",
    ),
    # Inputs.
    "a folder that is not there": (
        1,
        "source:\n  path: clop\n",
        "fire.yaml:2: source.path: *clop: does not exist; did you mean",
    ),
    "a glob without a match": (
        1,
        "source: {path: clip/*.tga}\n",
        "fire.yaml:1: source.path: *no file matches",
    ),
    "a start beyond the end": (
        1,
        "source:\n  path: clip\n  start: 50\n",
        "fire.yaml:3: source.start: is 50, but *only 6 frames",
    ),
    "a count beyond the end": (
        1,
        "source:\n  path: clip\n  count: 50\n",
        "fire.yaml:3: source.count: 50 from start 0 on",
    ),
    "a crop beyond the frame": (
        1,
        "source:\n  path: clip\n  crop: [0, 0, 99, 9]\n",
        "fire.yaml:3: source.crop: [0, 0, 99, 9]",
    ),
    "a height far too large": (
        1,
        "source:\n  path: clip\n  height: 16384\n",
        "fire.yaml:3: source.height: *is too large",
    ),
    "a grid on a folder": (
        1,
        "source:\n  path: clip\n  grid: {columns: 2, rows: 2}\n",
        "fire.yaml:3: source.grid: cuts one",
    ),
    "a grid that cannot be cut": (
        1,
        "source: {path: clip/0000.png, grid: {columns: 99, rows: 1}}\n",
        "fire.yaml:1: source.path: *a grid of 99 columns",
    ),
    "a layer of PNGs": (
        1,
        "source:\n  path: clip\n  layer: beauty\n",
        "fire.yaml:3: source.layer: names a layer of EXR",
    ),
    "an animation of a folder": (
        1,
        "source:\n  path: clip\n  animation: burn\n",
        "fire.yaml:3: source.animation: picks one",
    ),
    "a file of text for an image": (
        1,
        "source: {path: list.j2}\n",
        "fire.yaml:1: source.path: *list.j2",
    ),
    "a texture that is not there": (
        1,
        "source: {path: clip}\nflakes:\n  texture: star.png\n",
        "fire.yaml:3: flakes.texture: there is",
    ),
    "a ramp that is none": (
        1,
        "source: {path: clip}\natlas: {pixels: heat, ramp: souls}\n",
        "fire.yaml:2: atlas.ramp: souls is neither",
    ),
    "a template that is not there": (
        1,
        "source: {path: clip}\nexports:\n  - json\n  - {template: no.j2, to: x}\n",
        "fire.yaml:4: exports.1: there is no template",
    ),
    "a name that no template has": (
        1,
        "source: {path: clip}\nexports: [{template: list.j2, to: '{{ nmae }}'}]\n",
        "fire.yaml:2: exports.0: *'nmae' is undefined; did you mean name?; a template has name",
    ),
    "a template that cannot be parsed": (
        1,
        "source: {path: clip}\nexports: [{template: list.j2, to: '{{ name'}]\n",
        "fire.yaml:2: exports.0: *list.j2",
    ),
    "sprites of one CSS class": (
        1,
        "source: {kind: sprites, path: [icons/a.b.png, icons/a-b.png]}\nexports: [json, css]\n",
        "fire.yaml:2: exports.1: css cannot tell the sprite a.b and the sprite a-b apart",
    ),
    "sprites of one file in Godot": (
        1,
        "source: {kind: sprites, path: icons}\nexports:\n  - json\n  - godot\n",
        "fire.yaml:4: exports.1: godot cannot tell the sprites a/b and a-b apart",
    ),
    "sprites of one name in Unity": (
        1,
        "source: {kind: sprites, path: icons}\nexports: [unity]\n",
        "fire.yaml:2: exports.0: unity cannot tell the frames 'a/b' and 'a_b' apart",
    ),
    "members with sprites of one name": (
        1,
        "atlas: {members: [icons.yaml, others.yaml]}\n",
        "fire.yaml: 2 frames on these pages are called a-b",
    ),
    "a member that is not there": (
        2,
        "source: {path: clip}\natlas: {members: [no.yaml]}\n",
        "no.yaml: there is no such recipe",
    ),
    "too few frames to learn from": (
        1,
        "source:\n  kind: profile\n  path: clip\n  count: 2\n",
        "fire.yaml:3: source.path: *has 2 frames; a profile",
    ),
    # Limits that only the work itself shows.
    "silk too stiff": (
        2,
        "source:\n  kind: silk\n  stiffness: 10000\n",
        "fire.yaml:3: source.stiffness: 10000 with *time steps per second",
    ),
    "silk too fine": (
        2,
        "source:\n  kind: silk\n  rows: 256\n  columns: 256\n",
        "fire.yaml:1: source.sheets: 4 sheets",
    ),
    "an intruder that jumps": (
        2,
        "source:\n  kind: silk\n  intruders:\n"
        "    - {shape: sphere, keyframes: [{t: 0, at: [0, 0, 0]}, {t: 1, at: [1, 0, 0]}]}\n",
        "fire.yaml:4: source.intruders.0: is elsewhere after 2 s",
    ),
    "pressure that jumps": (
        2,
        "source:\n  kind: silk\n  pressure: {keyframes: [{t: 0, value: 1}, {t: 1, value: 2}]}\n",
        "fire.yaml:3: source.pressure: begins at 1 but is 2 after 2 s",
    ),
    "a clip too short to play there and back": (
        2,
        "source: {path: clip}\ntimeline:\n  loop: pingpong\n  frames: 80\n",
        "fire.yaml:4: timeline.frames: asks for 80 frames, but 6 frames",
    ),
    "an overlap longer than the clip": (
        2,
        "source: {path: clip}\ntimeline:\n  loop: crossfade\n  overlap: 9\n",
        "fire.yaml:4: timeline.overlap: is 9 frames",
    ),
    "a clip too short to go on": (
        2,
        "source: {path: clip}\ntimeline: {loop: none, frames: 99}\n",
        "fire.yaml:2: timeline.frames: asks for more than the 6 frames",
    ),
    "a timeline of several sizes": (
        1,
        "source: {path: sizes}\nflakes: none\nmotion_blur: none\ntimeline:\n  frames: 3\n",
        "fire.yaml:1: source.path: * all frames must have one size (to pack images of different",
    ),
    "far too many pixels": (
        1,
        "source:\n  kind: silk\n  width: 4096\n  height: 4096\n  rows: 4\n  columns: 4\n"
        "timeline:\n  frames: 9000\n",
        "fire.yaml:8: timeline.frames: 9000 frames of 4096x4096",
    ),
}


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inputs")
    corpus.write_clip(folder / "clip", 6)
    corpus.write_clip(folder / "sizes", 2)
    (folder / "sizes" / "large.png").write_bytes(
        (shipped("samples") / "campfire" / "0000.png").read_bytes()
    )
    (folder / "icons" / "a").mkdir(parents=True)
    for name in ("a.b", "a-b", "a_b", "a/b"):
        shutil.copy(shipped("samples") / "campfire" / "0000.png", folder / "icons" / f"{name}.png")
    for name in ("icons", "others"):
        path = "icons" if name == "icons" else "icons/a-b.png"
        (folder / f"{name}.yaml").write_text(f"source: {{kind: sprites, path: {path}}}\n")
    (folder / "list.j2").write_text("{% for frame in frames %}{{ frame.name }}{% endfor %}")
    return folder


@pytest.mark.parametrize(("code", "text", "message"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_gets_one_sentence_and_the_right_code(
    inputs: Path,
    code: int,
    text: str,
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(inputs)
    Path("fire.yaml").write_text(text, encoding="utf-8")
    said = []
    for command in (["check"], ["build", "--dry-run"], ["build"]):
        assert main([*command, "fire.yaml", "-q"]) == code
        output = capsys.readouterr()
        assert output.out == ""
        said.append(output.err)
    assert len(set(said)) == 1, said
    [line] = said[0].splitlines()
    assert line.startswith("error: ")
    at = 0
    for piece in message.split("*"):
        assert (at := line.find(piece.strip(), at)) >= 0, (piece, line)
    assert not Path("build").exists()


def test_there_are_sixty_of_them() -> None:
    assert len(MISTAKES) >= 60


def test_a_folder_names_its_faulty_recipes_at_the_end(
    inputs: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clip").symlink_to(inputs / "clip")
    for i in range(20):
        recipe = "source: {path: clip}\nflakes: none\nmotion_blur: none\n"
        (tmp_path / f"r{i:02}.yaml").write_text(recipe)
    (tmp_path / "r03.yaml").write_text("source: {path: clip}\nseed: -1\n")
    (tmp_path / "r07.yaml").write_text("source:\n  path: clop\n")
    (tmp_path / "r11.yaml").write_text("source: {path: clip}\nflakes:\n  rtae: 3\n")
    faults = [
        "  r03.yaml:2: seed: must be at least 0; got -1",
        "  r07.yaml:2: source.path: ",
        "  r11.yaml:3: flakes.rtae: unknown key; did you mean flakes.rate?",
    ]
    for command, totals in (
        ("check", "20 recipes: 17 ok, 3 failed"),
        ("build", "17 built, 3 fail"),
    ):
        assert main([command, "."]) == 2
        output = capsys.readouterr()
        *_, last, one, two, three = output.out.splitlines()
        assert totals in last
        for line, fault in zip((one, two, three), faults, strict=True):
            assert line.startswith(fault)
            assert f"error: {line.strip()}" in output.err
