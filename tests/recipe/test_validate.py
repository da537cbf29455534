"""Mistakes in recipes and the advice they get."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fire_atlas.core.errors import RecipeError
from fire_atlas.recipe.load import load_tree
from fire_atlas.recipe.source import FramesSource
from fire_atlas.recipe.tree import read_tree

Write = Callable[..., Path]
SOURCE = "source: {path: x}\n"


def advice(path: Path, *overrides: str) -> list[str]:
    """Return the lines of advice, without the folder in front."""
    with pytest.raises(RecipeError) as caught:
        load_tree(read_tree(path, overrides))
    assert caught.value.exit_code == 2
    lines = str(caught.value).splitlines()
    assert not any("literal" in line or "pydantic" in line or "<" in line for line in lines)
    return [line.removeprefix(f"{path.parent}/") for line in lines]


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("flakes:\n  alhpa: 1", "3: flakes.alhpa", "unknown key; did you mean flakes.alpha?"),
        (
            "atlas: {pivot: [5, 5]}",
            "2: atlas.pivot",
            "is in frame widths and heights, not px, from -2 to 3: [0.5, 1] is the middle of the "
            "bottom; got [5, 5]",
        ),
        (
            "buoyancy: {feature_force: 3}",
            "2: buoyancy.feature_force",
            "pushes with motion: features alone; with flow, the optical flow says how the flame "
            "moves. Remove it, or set buoyancy.motion: features",
        ),
        (
            "buoyancy: {motion: features, coupling: 3}",
            "2: buoyancy.coupling",
            "is how fast air adopts the optical flow, which motion: features does without; remove "
            "it, or set buoyancy.motion: flow",
        ),
        (
            "features: {preset: paper}\nwind: {gusts: {mean: 1}}",
            "3: wind",
            "blows against the flakes of a clip by buoyancy.drag, which is 0; set it to 2, or "
            "remove wind",
        ),
        (
            "motion_blur: {exaggeration: 2}",
            "2: motion_blur.exaggeration",
            "is of the flame's blur; add motion_blur.flame: true, or remove it",
        ),
        (
            "features: {preset: paper}\nflakes: {class: candle}",
            "3: flakes.class",
            "is unknown to features.preset: paper; remove it, and state what it would decide: "
            "rate, sparks",
        ),
        (
            "features: {preset: paper}\nflakes: {style: cartoon}",
            "3: flakes.style",
            "is unknown to features.preset: paper; remove it, and state what it would decide: "
            "size, colors, sprite",
        ),
        (
            "atlas: {cover: full}",
            "2: atlas.cover",
            "is of premultiplied pages, where it can be chosen; set alpha: premultiplied, or leave "
            "it out: pages with alpha straight cover as much as they shine",
        ),
        (
            "flakes: {class: flat}",
            "2: flakes.class",
            "says what burns, and flat how it looks: write `style: cartoon`, and leave class out",
        ),
        (
            "features: {preset: paper}\nflakes: {lag: 0.2}",
            "3: flakes.lag",
            "is part of flakes.own_motion, which is 0; set that, or remove it",
        ),
        (
            "features: {preset: paper}\nbuoyancy: {turbulence: 0.5}",
            "3: buoyancy.turbulence",
            "reaches flakes by buoyancy.drag or flakes.own_motion, and both are 0; set one of "
            "them, or remove it",
        ),
        (
            "flakes: {sparks: 0, bursts: 2}",
            "2: flakes.bursts",
            "throw sparks, of which flakes.sparks: 0 leaves none; remove one",
        ),
        (
            "flakes: {sprite: pixel, glow: 1}",
            "2: flakes.glow",
            "is of soft flakes, but sprite is pixel; remove one of them",
        ),
        (
            "flakes: none\nwind: {level: 2}",
            "3: wind",
            "has no flakes to carry: flakes is none; remove one of them",
        ),
        (
            "motion_blur: {samples: 20}",
            "2: motion_blur.samples",
            "is of the flame's blur; add motion_blur.flame: true, or remove it",
        ),
        ("Seed: 1", "2: Seed", "unknown key; did you mean seed?"),
        ("rate: 3", "2: rate", "unknown key; did you mean flakes.rate?"),
        ("flakes.rate: 3", "2: flakes.rate", "unknown key; write `rate` inside the block `flakes`"),
        (
            "composite: {zzz: 1}",
            "2: composite.zzz",
            "unknown key; the keys here are ramp, blend, intensity, palette",
        ),
        (
            "exports: [{unity: {ppu: 3}}]",
            "2: exports.0.unity.ppu",
            "unknown key; the keys here are pixels_per_unit, flakes, namespace, assembly, player",
        ),
        (
            "exports: [{unity: {}, to: x}]",
            "2: exports.0.to",
            "unknown key; it cannot be combined with the other keys of its block",
        ),
        (
            "exports: [{unity: {namespace: Game.class}}]",
            "2: exports.0.unity.namespace",
            "class is a keyword of C#; choose another name",
        ),
        (
            "exports: [{unity: {namespace: 3d}}]",
            "2: exports.0.unity.namespace",
            'must be a namespace of C#, like Game.Fire; got "3d"',
        ),
        (
            "exports: [{phaser: {}}]",
            "2: exports.0",
            "must be the name of a format, {unity: ...}, {css: ...}, or "
            '{template: ..., to: ...}; got {"phaser": {}}',
        ),
        ("flakes: {lag: fast}", "2: flakes.lag", 'must be a number; got "fast"'),
        ("flakes: {lag: '80'}", "2: flakes.lag", 'must be a number; got "80"'),
        ("flakes: {lag: yes}", "2: flakes.lag", "must be a number; got true"),
        ("flakes: {rate: fast}", "2: flakes.rate", 'must be `auto` or a number; got "fast"'),
        ("flakes: {bake: 1}", "2: flakes.bake", "must be true or false; got 1"),
        ("flakes: {life: 1}", "2: flakes.life", "must be a list, like [a, b]; got 1"),
        ("flakes: {life: [1]}", "2: flakes.life.1", "is missing: the list needs 2 items"),
        (
            "flakes: {life: [1, 2, 3]}",
            "2: flakes.life",
            "must be a list of at most 2; got [1, 2, 3]",
        ),
        (
            "flakes: {life: [3, 2]}",
            "2: flakes.life",
            "the first number must not exceed the second; got [3.0, 2.0]",
        ),
        ("flakes: {life: [1, 99]}", "2: flakes.life.1", "must be at most 60; got 99"),
        ("flakes: {life: [0, 9]}", "2: flakes.life.0", "must be more than 0; got 0"),
        ("flakes: {rate: .inf}", "2: flakes.rate", "must be a finite number; got inf"),
        (
            "flakes: {colors: [red]}",
            "2: flakes.colors.0",
            'must be a colour like "#ff7300", with the quotes; got "red"',
        ),
        ("flakes: {colors: []}", "2: flakes.colors", "must be a list of at least 1; got []"),
        ("flakes: nnoe", "2: flakes", 'must be `none` or a block of settings; got "nnoe"'),
        ("flakes: {alpha: fast}", "2: flakes.alpha", 'must be `auto` or a number; got "fast"'),
        ("features: {epsilon: -1}", "2: features.epsilon", "must be at least 0; got -1"),
        (
            "buoyancy: {lift: up}",
            "2: buoyancy.lift",
            'must be `auto`, a number, or two: [x, y]; got "up"',
        ),
        ("buoyancy: {lift: [1, up]}", "2: buoyancy.lift.1", 'must be a number; got "up"'),
        ("buoyancy: {cell: 2.5}", "2: buoyancy.cell", "must be a whole number; got 2.5"),
        ("features: ~", "2: features", "must be a block of settings; got null"),
        (
            "atlas:\n  layout: gird",
            "3: atlas.layout",
            'must be one of packed, grid; got "gird"; did you mean grid?',
        ),
        (
            "tracks: [pcahe]",
            "2: tracks.0",
            'must be one of json, csv, pcache, hjson, light; got "pcahe"; did you mean pcache?',
        ),
        (
            "atlas:\n  layout: grid\n  rotate: true",
            "4: atlas.rotate",
            "a grid shows every frame upright; use layout packed, or leave rotate out",
        ),
        (
            "atlas:\n  border: 2\n  layout: grid",
            "3: atlas.border",
            "the cells of a grid divide the page evenly; padding is their gutter",
        ),
        (
            "atlas:\n  layout: grid\n  dedupe: true",
            "4: atlas.dedupe",
            "a grid has one cell for every frame; use layout packed, or leave it out",
        ),
        (
            "atlas:\n  border: 8\n  max_size: 16",
            "3: atlas.border",
            "two of 8 px leave nothing of max_size 16",
        ),
        (
            "atlas:\n  alpha: additive\n  bleed: 2",
            "4: atlas.bleed",
            "alpha additive needs none; colour under transparent pixels would be added to the "
            "picture",
        ),
        (
            "atlas:\n  trim: none\n  trim_threshold: 3",
            "4: atlas.trim_threshold",
            "nothing is cut with trim none; leave one of them out",
        ),
        (
            "timeline:\n  loop: pingpong\n  tail: true",
            "4: timeline.tail",
            "lets flakes burn out after a clip that plays once, and loop: pingpong never ends; "
            "leave tail out, or use loop: none",
        ),
        (
            "timeline:\n  loop: pingpong\n  overlap: 3",
            "4: timeline.overlap",
            "is the length of a cross-fade, but loop: pingpong has none; leave overlap out, or use "
            "loop: crossfade",
        ),
        (
            "timeline:\n  loop: pingpong\n  frames: 5",
            "4: timeline.frames",
            "a pingpong has an even number of frames; frames: 6 or 4 would be one",
        ),
        (
            "flakes: none\ntimeline:\n  tail: true",
            "4: timeline.tail",
            "waits for flakes to burn out, but flakes is none; remove one of them",
        ),
        (
            "timeline: {tail: true}\nflakes: {rate: 0}",
            "2: timeline.tail",
            "waits for flakes to burn out, but flakes.rate is 0; remove one of them",
        ),
        (
            "wind: {level: 2}\nflakes: {max: 0}",
            "2: wind",
            "has no flakes to carry: flakes.max is 0; remove one of them",
        ),
        (
            "flakes: {rate: 0, bake: false, variants: 2}",
            "2: flakes.variants",
            "asks for flakes, but flakes.rate is 0; remove one of them",
        ),
        (
            "flakes:\n  class: gas\n  bake: false\n  variants: 2",
            "5: flakes.variants",
            "asks for flakes, but flakes.class is gas, which sheds none; remove one of them",
        ),
        (
            "flakes: {max: 0, bursts: 1}",
            "2: flakes.bursts",
            "asks for flakes, but flakes.max is 0; remove one of them",
        ),
        (
            "flakes: {rate: 0, sparks: 0.5}",
            "2: flakes.sparks",
            "asks for flakes, but flakes.rate is 0; remove one of them",
        ),
        (
            "flakes: {rate: 0, bake: false, rounds: 3}",
            "2: flakes.rounds",
            "asks for flakes, but flakes.rate is 0; remove one of them",
        ),
        (
            "flakes: {rate: 0, texture: ember.png}",
            "2: flakes.texture",
            "asks for flakes, but flakes.rate is 0; remove one of them",
        ),
        (
            "flakes: {rate: 0}\nmaps: {flakes: true}",
            "3: maps.flakes",
            "draws the flakes alone, but flakes.rate is 0; remove one of them",
        ),
        (
            "flakes: {rounds: 3}",
            "2: flakes.rounds",
            "the pages show the flakes of one round of the loop; use auto, or flakes.bake: false "
            "plays the flakes from their tracks instead",
        ),
        (
            "flakes: {bake: false, rounds: 3}\nmaps: {flakes: true}",
            "2: flakes.rounds",
            "the pages show the flakes of one round of the loop; use auto, or remove maps.flakes",
        ),
        (
            "seed: 1\nviews: {count: 2}",
            "3: views",
            "frames have one side only; leave views out, or make 3D fire with source.kind: "
            "silk, fluid or profile",
        ),
        (
            "exports:\n  - json\n  - unity:\n      assembly: true",
            "5: exports.1.unity.assembly",
            "needs a `namespace` of your own, a different one for each folder: names of "
            "assemblies must be unique in a Unity project",
        ),
        (
            "exports:\n  - unity:\n      assembly: true\n      player: package",
            "4: exports.0.unity.assembly",
            "has no scripts to hold with player: package; remove it",
        ),
        ("version: 2", "2: version", "must be 1; got 2"),
        ("seed: -1", "2: seed", "must be at least 0; got -1"),
        ("name: 7", "2: name", "must be text (put it in quotes if it is meant to be); got 7"),
    ],
)
def test_each_mistake_gets_its_line_of_advice(
    write: Write, text: str, place: str, message: str
) -> None:
    assert advice(write(SOURCE + text)) == [f"campfire.yaml:{place}: {message}"]


@pytest.mark.parametrize(
    ("keys", "place", "message"),
    [
        ("height: tall", "height", 'must be `auto`, `source` or a whole number; got "tall"'),
        ("height: 0", "height", "must be at least 1; got 0"),
        ("crop: [1, 2, 3]", "crop.3", "is missing: the list needs 4 items"),
        ("crop: [1, 2, 0, 4]", "crop.2", "must be at least 1; got 0"),
        (
            "crop: left",
            "crop",
            'must be `none`, `auto` or four whole numbers: [x, y, width, height]; got "left"',
        ),
    ],
)
def test_a_wrong_part_or_size_of_frames_gets_advice(
    write: Write, keys: str, place: str, message: str
) -> None:
    text = f"source:\n  path: clip\n  {keys}\n"
    assert advice(write(text)) == [f"campfire.yaml:3: source.{place}: {message}"]


@pytest.mark.parametrize("name", ["../x", "a/b", "/etc/x", "..", ".x", "x.", "a b", "a\\\\b"])
def test_a_name_that_is_no_plain_file_name_is_refused(write: Write, name: str) -> None:
    [line] = advice(write(f'{SOURCE}name: "{name}"'))
    assert line.startswith("campfire.yaml:2: name: must be a plain file name, not a path")


@pytest.mark.parametrize("name", ["con", "NUL", "Com1", "aux.fire", "lpt9", "prn.1.x"])
def test_a_name_that_windows_keeps_for_a_device_is_refused(write: Write, name: str) -> None:
    [line] = advice(write(f"{SOURCE}name: {name}"))
    assert line.startswith("campfire.yaml:2: name: must be a plain file name")
    assert "Windows" in line


@pytest.mark.parametrize("name", ["a.manifest", "A.MANIFEST"])
def test_a_name_whose_json_would_be_taken_for_a_manifest_is_refused(
    write: Write, name: str
) -> None:
    [line] = advice(write(f"{SOURCE}name: {name}"))
    assert line.startswith("campfire.yaml:2: name: must be a plain file name")
    assert "nor one that ends in .manifest" in line


def test_of_thousands_of_mistakes_the_first_fifty_are_reported(write: Write) -> None:
    keys = "".join(f"x{i}: 1\n" for i in range(4000))
    *lines, last = advice(write(SOURCE + keys))
    assert len(lines) == 50 and lines[0].startswith("campfire.yaml:2: x0: unknown key")
    assert last == "campfire.yaml: 3950 more mistakes; correct these first"


@pytest.mark.parametrize("name", ["console", "com10", "nullfire", "fire.con"])
def test_a_name_that_only_looks_like_a_device_is_good(write: Write, name: str) -> None:
    assert load_tree(read_tree(write(f"{SOURCE}name: {name}"))).recipe.name == name


def test_a_missing_source_is_asked_for(write: Write) -> None:
    assert advice(write("\nseed: 1")) == [
        "campfire.yaml:1: source: is missing: where the fire comes from"
    ]


def test_a_missing_key_is_reported_at_its_block(write: Write) -> None:
    [line] = advice(write("seed: 1\nsource:\n  fps: 3"))
    assert line.startswith("campfire.yaml:2: source.path: is missing: a folder of images, a glob")


def test_text_where_a_block_belongs_is_shown_the_block(write: Write) -> None:
    assert advice(write("source: fire.gif")) == [
        'campfire.yaml:1: source: must be a block, like {path: ...}; got "fire.gif"'
    ]


def test_all_mistakes_are_listed_in_the_order_of_their_lines(write: Write) -> None:
    text = "zzz: 1\natlas: {layuot: grid}\nseed: x\nsource: {path: x, start: -1}"
    keys = [line.split(":")[2].strip() for line in advice(write(text))]
    assert keys == ["zzz", "atlas.layuot", "seed", "source.start"]


def test_all_contradictions_of_a_recipe_are_listed(write: Write) -> None:
    text = "timeline: {loop: none, tail: true, overlap: 3, frames: 9}\nsource: {kind: silk}"
    assert [line.split(": ")[1] for line in advice(write(text))] == [
        "timeline.overlap",
        "timeline.tail",
    ]
    text = SOURCE + "atlas: {layout: grid, rotate: true, border: 2}\ntimeline: {loop: pingpong}"
    lines = advice(write(text), "timeline.tail=true")
    assert [line.split(": ")[1] for line in lines[1:]] == ["atlas.rotate", "atlas.border"]
    assert lines[0].startswith("--set timeline.tail: lets flakes burn out")


def test_a_mistake_of_set_names_the_option(write: Write) -> None:
    assert advice(write(SOURCE), "flakes.rate=fast", "flakes.alhpa=3") == [
        '--set flakes.rate: must be `auto` or a number; got "fast"',
        "--set flakes.alhpa: unknown key; did you mean flakes.alpha?",
    ]


def test_a_mistake_in_an_inherited_recipe_names_its_file(write: Write) -> None:
    write("\n\nflakes: {rate: x}\n" + SOURCE, "base.yaml")
    [line] = advice(write("extends: base.yaml"))
    assert line.startswith("base.yaml:3: flakes.rate: ")


def test_long_values_are_shortened(write: Write) -> None:
    [line] = advice(write(f"{SOURCE}seed: {'x' * 500}"))
    assert len(line) < 130
    assert line.endswith("...")


@pytest.mark.parametrize("off", ["none", "off", "no", "~", "false"])
def test_effects_can_be_switched_off_in_any_way_yaml_knows(write: Write, off: str) -> None:
    source = f"source: {{path: x, matte: {off}}}"
    effects = f"flakes: {off}\nmotion_blur: {off}\natlas: {{trim: {off}}}"
    recipe = load_tree(read_tree(write(f"{source}\n{effects}"))).recipe
    assert (recipe.flakes, recipe.motion_blur) == ("none", "none")
    assert isinstance(recipe.source, FramesSource)
    assert (recipe.atlas.trim, recipe.source.matte) == ("none", "none")


def test_whole_numbers_are_good_where_numbers_are_asked_for(write: Write) -> None:
    recipe = load_tree(
        read_tree(write(SOURCE + "buoyancy: {lift: [0, 1]}\nflakes: {alpha: 1}"))
    ).recipe
    assert recipe.buoyancy.lift == (0.0, 1.0)
