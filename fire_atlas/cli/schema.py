"""The command ``schema``: print the JSON Schema of recipes."""

import json
from argparse import Namespace

from fire_atlas.recipe.schema import recipe_schema


def run(args: Namespace) -> int:
    """Print the JSON Schema of a recipe."""
    print(json.dumps(recipe_schema(), indent=2, ensure_ascii=False))
    return 0
