"""Formats that are templates: CSS, Unity's tpsheet, and the user's own."""

import re
from pathlib import Path

import pytest

from fire_atlas.atlas.pages import build_sheets
from fire_atlas.core.errors import OutputError, RecipeError, SourceError
from fire_atlas.formats.templates import export as user_template
from fire_atlas.formats.templates.export import export_template
from fire_atlas.pipeline.files.exports import exported_files, exporter
from fire_atlas.recipe.output import Atlas, TemplateExport
from tests.support.sheets import animation_of, product_of, sheet_of, sheet_of_fire, sheets_of


def rendered(text: str, folder: Path, to: str = "{{ name }}.txt") -> str:
    template = folder / "mine.j2"
    template.write_text(text, encoding="utf-8")
    file = export_template(sheet_of_fire(), TemplateExport(template="mine.j2", to=to), template)
    return file.data.decode()


def test_css_shows_every_frame_for_its_time() -> None:
    (file,) = exporter("css")(product_of(sheet_of([(20, 30), (10, 12)])))
    css = file.data.decode()
    assert file.name == "campfire.css"
    assert css.count("{") == css.count("}")
    steps = re.findall(r"^  ([\d.]+)% \{ left: (\d+)px; top: (\d+)px; width: (\d+)px;", css, re.M)
    assert steps == [("0.0", "5", "3", "20"), ("50.0", "5", "3", "10")]
    assert 'background: url("campfire.png")' in css
    assert "step-end infinite" in css
    assert ".campfire-0001 {" in css


def test_a_fire_that_goes_out_plays_once_and_stays() -> None:
    sheet = build_sheets("puff", [animation_of([(9, 9), (8, 8)], "puff", loop=False)], Atlas())[0]
    (file,) = exporter("css")(product_of(sheet))
    assert "step-end 1 forwards" in file.data.decode()
    assert "50.0%, to {" in file.data.decode()


def test_tpsheet_counts_from_the_bottom_and_pivots_in_the_trimmed_frame() -> None:
    sheet = sheet_of([(20, 30)] * 2, pivot=[0.5, 1.0], dedupe=False)
    (file,) = exporter("tpsheet")(product_of(sheet))
    lines = file.data.decode().splitlines()
    assert ":texture=campfire.png" in lines
    page, region = sheet.pages[0], sheet.regions[1]
    # The pivot of the frame, (30, 60) px, is 25 px right and 57 px down of the trimmed corner.
    assert lines[-1] == (
        f"campfire/0001;{region.x};{page.height - region.y - 30};20;30; 1.25;-0.9; 0;0;0;0"
    )


def test_tpsheet_has_a_file_for_every_page() -> None:
    files = list(
        exporter("tpsheet")(product_of(sheet_of([(20, 30)] * 9, max_size=64, dedupe=False)))
    )
    assert [file.name for file in files] == ["campfire.tpsheet", "campfire-1.tpsheet"]
    frames = "".join(file.data.decode() for file in files)
    assert frames.count("campfire/000") == 9


def test_a_template_sees_the_sheet(tmp_path: Path) -> None:
    text = "{% for f in frames %}{{ f.name }} {{ f.x }},{{ f.y }} {{ f.duration }}\n{% endfor %}"
    lines = rendered(text, tmp_path).splitlines()
    regions = sheet_of_fire().regions
    assert lines == [f"{r.name} {r.x},{r.y} 41.667" for r in regions]


def test_a_templates_file_name_is_a_template_too(tmp_path: Path) -> None:
    template = tmp_path / "mine.j2"
    template.write_text("{{ scale }}", encoding="utf-8")
    export = TemplateExport(template="mine.j2", to="{{ name | upper }}.ext")
    sheets = sheets_of([(20, 30)], scales=[1, 0.5])
    files = list(exported_files([export], product_of(*sheets), {"mine.j2": template}))
    assert [(file.name, file.data) for file in files] == [
        ("CAMPFIRE.ext", b"1"),
        ("CAMPFIRE@0.5X.ext", b"0.5"),
    ]


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("{{ ''.__class__.__mro__ }}", "mine.j2:1: a template must not do that: .*__class__"),
        ("\n{{ name.__init__.__globals__ }}", "must not do that"),
        ("{{ frames.append(1) }}", "must not do that"),
        ("{{ cycler.__init__.__globals__.os.popen('id').read() }}", "must not do that"),
        ("{{ open('/etc/passwd').read() }}", "'open' is undefined"),
        ("{% include '/etc/passwd' %}", "cannot include, import or extend"),
        ("{% import 'os' as os %}", "cannot include, import or extend"),
        ("{{ frame.name }}", "'frame' is undefined"),
        ("{{ frames[0].nmae }}", "no attribute 'nmae'"),
        ("a\nb\n{% for %}", "mine.j2:3: "),
        ("{% for i in range(10 ** 12) %}{% endfor %}", "[Rr]ange too big"),
        ("{{ 'a' * 10 ** 11 }}", "too much memory"),
        ("{{ 1 / 0 }}", "ZeroDivisionError"),
        (
            "{% for i in range(99999) %}{{ 'a' * 9999 }}{% endfor %}",
            "writes more than 64 MiB",
        ),
        ("{{ lipsum() }}", "'lipsum' is undefined"),
        ("{{ [1, 2, 3] | random }}", "No filter named 'random'"),
        (
            "{{ name.upper }}",
            "mine.j2: the template prints <built-in method .* from build to build",
        ),
        ("{{ frames | map(attribute='x') }}", "prints <generator object .* from build to build"),
        ("{{ (frames | map(attribute='x')) ~ '' }}", "prints <generator object"),
        ("{{ '\\ud800' }}", r"mine.j2: the template writes '\\ud800', half of a surrogate pair"),
    ],
)
def test_a_hostile_or_broken_template_is_refused_with_advice(
    text: str, advice: str, tmp_path: Path
) -> None:
    with pytest.raises(OutputError, match=advice):
        rendered(text, tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(60)
@pytest.mark.parametrize(
    "text",
    [
        "{% for a in range(99999) %}{% for b in range(99999) %}{% endfor %}{% endfor %}",
        "{{ 9 ** (9 ** (9 ** 9)) }}",
        "{% macro f() %}{{ f() }}{{ f() }}{% endmacro %}{{ f() }}",
    ],
)
def test_a_template_without_end_is_stopped(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(user_template, "MAX_SECONDS", 1)
    with pytest.raises(OutputError, match=r"stopped after 1 s|too much|[Rr]ecursion"):
        rendered(text, tmp_path)


@pytest.mark.parametrize(
    "to",
    ["../x.txt", "/tmp/x", "a/b", "a\\b", ".hidden", "{{ '' }}", "a\nb",
     "CON", "nul.{{ name }}", "x.", "x ", "a:b", "a?", "a\x1b[2J"],
)  # fmt: skip
def test_a_template_writes_beside_the_other_outputs_only(to: str, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="not a plain file name"):
        rendered("x", tmp_path, to)


@pytest.mark.parametrize("to", ["{{ 'a' * 201 }}", "{{ 'a' * 10 ** 7 }}"])
def test_the_name_that_a_template_gives_is_bounded(to: str, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"gives a name of \d+ characters; at most 200"):
        rendered("x", tmp_path, to)


def test_a_template_does_not_write_over_another_output(tmp_path: Path) -> None:
    template = tmp_path / "mine.j2"
    template.write_text("x", encoding="utf-8")
    for taken in ("campfire.json", "campfire.png", "Campfire.JSON"):
        exports = ["json", TemplateExport(template="mine.j2", to=taken)]
        with pytest.raises(OutputError, match=f"would write {taken}, which is another output"):
            list(exported_files(exports, product_of(sheet_of_fire()), {"mine.j2": template}))  # type: ignore[arg-type]


def test_an_export_listed_twice_is_reported() -> None:
    with pytest.raises(OutputError, match="list it once"):
        list(exported_files(["json", "json"], product_of(sheet_of_fire()), {}))


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00", b"a" * (1 << 21)])
def test_a_template_that_is_none_is_reported(content: bytes | None, tmp_path: Path) -> None:
    path = tmp_path / "mine.j2"
    if content is not None:
        path.write_bytes(content)
    export = TemplateExport(template="mine.j2", to="x.txt")
    with pytest.raises((RecipeError, SourceError), match=r"mine\.j2"):
        export_template(sheet_of_fire(), export, path)
