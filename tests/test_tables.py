"""What a recipe may name and the tables of what makes it are the same, name by name."""

from typing import get_args

import pytest

from fire_atlas.engines.engine import ENGINES, Engine, engine
from fire_atlas.formats.tables import EXPORTS, MOVIES, TRACKS, Format
from fire_atlas.maps.kinds import KINDS, MapKind, kinds_in
from fire_atlas.maps.maker import Maker, maker_of
from fire_atlas.recipe.output import ExportName, FlakeTrackName, Maps, MovieName


def test_each_name_of_a_recipe_has_a_row_and_each_row_a_name() -> None:
    assert sorted([*EXPORTS, *ENGINES]) == sorted(get_args(ExportName))
    assert sorted(TRACKS) == sorted(get_args(FlakeTrackName))
    assert sorted(MOVIES) == sorted(get_args(MovieName))
    assert sorted(kind.name for kind in KINDS) == sorted(Maps.model_fields)


@pytest.mark.parametrize("row", [*EXPORTS.values(), *TRACKS.values(), *MOVIES.values()])
def test_the_writer_of_each_row_is_there(row: Format) -> None:
    assert row.write.__doc__


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_each_map_has_a_maker_and_is_asked_for_by_its_key(kind: MapKind) -> None:
    assert isinstance(maker_of(kind), Maker)
    value = {"motion": "unity", "emission": "exr"}.get(kind.name, True)
    assert kinds_in(Maps.model_validate({kind.name: value})) == (kind,)


@pytest.mark.parametrize("name", ENGINES)
def test_each_engine_has_all_parts_itself(name: str) -> None:
    parts = {part for part in vars(Engine) if not part.startswith("_")}
    assert parts <= vars(type(engine(name))).keys() and len(parts) == 7
