"""Define and parse the arguments of all commands. Imports little, so that --help is quick."""

import argparse
import os
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NoReturn, TypeAlias

from fire_atlas.core.errors import RecipeError
from fire_atlas.core.version import __version__

if TYPE_CHECKING:
    from pathlib import Path

_DESCRIPTION = (
    "Turn fire into engine-ready sprite atlases with fire-flakes that fly with the flame."
)
_EPILOG = """\
start with:
  fire-atlas init                  list the ready recipes
  fire-atlas init campfire         copy one, with its sample input
  fire-atlas init fire.mp4         write a recipe for a clip of your own
  fire-atlas build campfire.yaml   write build/campfire.png, .json, ...

exit codes: 0 built or up to date, 1 a build failed, 2 invalid recipe or usage, 130 interrupted"""


DEFAULT_MAX_PIXELS = 8192 * 8192
"""Default of ``--limit-pixels``: that of core.workload, which --help does not import."""


class _Formatter(argparse.RawDescriptionHelpFormatter):
    """Formats help texts; finds the width without ``shutil``, which is slow to import."""

    def __init__(self, prog: str) -> None:
        try:
            columns = os.get_terminal_size().columns
        except OSError:
            columns = 80
        super().__init__(prog, max_help_position=30, width=min(columns, 100) - 2)


class _Parser(argparse.ArgumentParser):
    """A parser that reports mistakes as ``RecipeError``."""

    def __init__(self, **settings: object) -> None:
        super().__init__(formatter_class=_Formatter, allow_abbrev=False, **settings)  # type: ignore[arg-type]

    def error(self, message: str) -> NoReturn:
        """Raise instead of exiting."""
        raise RecipeError(f"{message} (see {self.prog} --help)")


def all_parsers() -> tuple[argparse.ArgumentParser, dict[str, "_Parser"]]:
    """Return the parser of the whole command line, and that of each command."""
    parser = _Parser(prog="fire-atlas", description=_DESCRIPTION, epilog=_EPILOG)
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")
    parsers = {
        "build": _add_build(commands),
        "check": _add_check(commands),
        "init": _add_init(commands),
        "learn": _add_learn(commands),
        "watch": _add_watch(commands),
        "clean": _add_clean(commands),
        "cache": _add_cache_command(commands),
        "preview": _add_preview(commands),
        "inspect": _add_inspect(commands),
        "plugin": _add_plugin(commands),
        "schema": _add_schema(commands),
        "completion": _add_completion(commands),
    }
    return parser, parsers


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Return the arguments; ``command`` names the command. Exits for ``--help``, ``--version``."""
    parser, parsers = all_parsers()
    word = argv[0] if argv else "--help"
    if word in {"-h", "--help", "--version"}:
        parser.parse_args([word])
    if word not in parsers:
        raise RecipeError(_no_command(word, parsers))
    chosen = parsers[word]
    # Intermixed: `build a.yaml -o out b.yaml` names two recipes.
    args, rest = chosen.parse_known_intermixed_args(_without_dashes(argv[1:]))
    _refuse_rest(chosen, rest)
    args.command = word
    return args


def _without_dashes(argv: Sequence[str]) -> list[str]:
    """Return ``argv`` such that what stands behind ``--`` begins with no dash: ``./-x.yaml``.

    argparse parses intermixed arguments twice, and forgets ``--`` after the first time.
    """
    end = argv.index("--") if "--" in argv else len(argv)
    names = (f"./{word}" if word.startswith("-") else word for word in argv[end + 1 :])
    return [*argv[: end + 1], *names]


def refuse_build_options(args: argparse.Namespace, others: Mapping[str, object], why: str) -> None:
    """Raise for an option that says how to build, or one of ``others`` by name, if it is given.

    Raises:
        RecipeError: It is; ``why`` it is of no use follows the option's name.
    """
    given = {
        "--set": args.overrides,
        "--jobs": args.jobs,
        "--limit-pixels": args.max_pixels != DEFAULT_MAX_PIXELS,
        **others,
    }
    for option, value in given.items():
        if value:
            raise RecipeError(f"{option} {why}")


_Commands: TypeAlias = "argparse._SubParsersAction[_Parser]"


def _add_build(commands: _Commands) -> _Parser:
    parser = commands.add_parser("build", help="build effects from recipes")
    _add_recipes(parser)
    _add_out(parser)
    _add_set(parser)
    _add_jobs(parser)
    _add_overwrite(parser)
    _add_limits(parser)
    _add_cache(parser)
    parser.add_argument("--force", action="store_true", help="build even if up to date")
    parser.add_argument(
        "--dry-run", action="store_true", help="say what would be built, and why; write nothing"
    )
    parser.add_argument(
        "--frozen",
        action="store_true",
        help="for CI: build nothing, fail if anything would be built",
    )
    parser.add_argument(
        "--depfile",
        type=path_of,
        metavar="FILE",
        help="write what outputs depend on, for make, ninja",
    )
    parser.add_argument("--json", action="store_true", help="report as JSON lines on stdout")
    _add_batch(parser)
    _add_volume(parser)
    return parser


def _add_check(commands: _Commands) -> _Parser:
    parser = commands.add_parser("check", help="validate recipes without building")
    _add_recipes(parser)
    parser.add_argument("--resolved", action="store_true", help="print them with all defaults")
    _add_set(parser)
    _add_volume(parser)
    return parser


def _add_init(commands: _Commands) -> _Parser:
    parser = commands.add_parser(
        "init", help="begin with a ready recipe, or with a recipe for a clip of your own"
    )
    parser.add_argument(
        "subject",
        nargs="?",
        metavar="PRESET|PATH",
        help="a ready recipe, copied with its sample input; or a clip, a picture or a folder of "
        "frames, for which a recipe is written; without one: list the ready recipes",
    )
    parser.add_argument("folder", nargs="?", type=path_of, default=".", metavar="DIR")
    _add_jobs(parser)
    _add_limits(parser)
    _add_volume(parser)
    return parser


def _add_learn(commands: _Commands) -> _Parser:
    parser = commands.add_parser("learn", help="learn a fire profile from a short clip")
    parser.add_argument("clip", type=path_of, metavar="CLIP", help="8-60 frames of one fire")
    parser.add_argument(
        "-o",
        "--out",
        type=path_of,
        metavar="FILE",
        help="default: CLIP's name with .profile.json, in this folder",
    )
    parser.add_argument(
        "--side",
        type=path_of,
        metavar="CLIP",
        help="a second clip of the same fire, filmed from its right side",
    )
    _add_set(parser, "a key of source, like fps=30 or threshold=90")
    _add_jobs(parser)
    _add_overwrite(parser, "replace files that are there")
    _add_limits(parser)
    _add_volume(parser)
    return parser


def _add_watch(commands: _Commands) -> _Parser:
    parser = commands.add_parser("watch", help="build recipes, and again whenever they change")
    _add_recipes(parser)
    _add_out(parser)
    _add_set(parser)
    _add_jobs(parser)
    _add_overwrite(parser)
    _add_limits(parser)
    _add_cache(parser)
    parser.set_defaults(force=False)
    _add_volume(parser)
    return parser


def _add_clean(commands: _Commands) -> _Parser:
    parser = commands.add_parser("clean", help="remove what builds of recipes wrote")
    _add_recipes(parser)
    _add_out(parser)
    _add_set(parser)
    _add_volume(parser)
    return parser


def _add_cache_command(commands: _Commands) -> _Parser:
    parser = commands.add_parser("cache", help="describe a cache of builds, or make it smaller")
    parser.add_argument("action", choices=["info", "prune"], metavar="info|prune")
    parser.add_argument(
        "location",
        nargs="?",
        metavar="DIR|URL",
        help="default: FIRE_ATLAS_CACHE of the environment",
    )
    parser.add_argument(
        "--max-size", metavar="SIZE", help="prune: remove the oldest beyond this size, like 2G"
    )
    parser.add_argument(
        "--older-than", metavar="AGE", help="prune: remove what was not used for, like 30d"
    )
    _add_volume(parser)
    return parser


def _add_preview(commands: _Commands) -> _Parser:
    parser = commands.add_parser("preview", help="make an HTML player of a result, or a picture")
    parser.add_argument("subject", type=path_of, metavar="RECIPE|ATLAS.json")
    kinds = parser.add_mutually_exclusive_group()
    for kind, about in (
        ("gif", "an animated GIF"),
        ("webp", "an animated WebP, lossless"),
        ("apng", "an animated PNG"),
        ("sheet", "a contact sheet"),
    ):
        kinds.add_argument(f"--{kind}", dest="kind", action="store_const", const=kind, help=about)
    parser.set_defaults(kind="page")
    kinds.add_argument(
        "--field",
        action="store_true",
        help="of a recipe: the page also shows how the fire is analysed",
    )
    parser.add_argument("-o", "--out", type=path_of, metavar="FILE", help="file to write")
    parser.add_argument(
        "--background",
        default="#101014",
        metavar="COLOR",
        help="colour (default: %(default)s), or of a picture that moves: transparent",
    )
    _add_set(parser)
    _add_jobs(parser)
    _add_overwrite(parser, "replace files that are there")
    _add_limits(parser)
    _add_volume(parser)
    return parser


def _add_inspect(commands: _Commands) -> _Parser:
    parser = commands.add_parser("inspect", help="describe a built atlas")
    parser.add_argument("subject", type=path_of, metavar="ATLAS.json")
    for name, about in (
        ("pages", "sizes, frames, occupancy, safe mip levels"),
        ("memory", "what each image and texture takes on a GPU"),
        ("budget", "what it was spent on, and what others would give"),
        ("frames", "of each animation: length, rate, sizes, pivot"),
        ("overdraw", "what a renderer draws of each animation"),
        ("loops", "how well each loop closes"),
        ("maps", "files and strengths of maps"),
        ("flakes", "figures of the flakes"),
    ):
        parser.add_argument(
            f"--{name}", dest="details", action="append_const", const=name, help=about
        )
    parser.set_defaults(details=[])
    parser.add_argument("--json", action="store_true", help="print all of it as JSON")
    parser.add_argument(
        "--context", action="store_true", help="print the data that templates get, as JSON"
    )
    _add_volume(parser)
    return parser


def _add_plugin(commands: _Commands) -> _Parser:
    parser = commands.add_parser("plugin", help="copy the add-on of an engine into a project")
    parser.add_argument("engine", choices=["godot", "unity"], metavar="godot|unity")
    parser.add_argument(
        "folder",
        nargs="?",
        type=path_of,
        default=".",
        metavar="DIR",
        help="the project's folder (default: this folder)",
    )
    _add_overwrite(parser, "replace files that this command did not write, or that were changed")
    _add_volume(parser)
    return parser


def _add_schema(commands: _Commands) -> _Parser:
    parser = commands.add_parser("schema", help="print the JSON Schema of recipes, for editors")
    _add_volume(parser)
    return parser


def _add_completion(commands: _Commands) -> _Parser:
    parser = commands.add_parser("completion", help="print a script that completes commands")
    parser.add_argument("shell", choices=["bash", "zsh", "fish"], metavar="bash|zsh|fish")
    _add_volume(parser)
    return parser


_Options: TypeAlias = "argparse.ArgumentParser | argparse._ArgumentGroup"


def _add_recipes(parser: _Parser) -> None:
    parser.add_argument(
        "recipes", nargs="+", type=path_of, metavar="RECIPE", help="a recipe, or a folder of them"
    )


def _add_out(parser: _Parser) -> None:
    parser.add_argument(
        "-o",
        "--out",
        type=path_of,
        metavar="DIR",
        help="output folder (default: build/ beside the recipe)",
    )


def _add_overwrite(
    parser: _Options, meaning: str = "replace even files that no build wrote"
) -> None:
    parser.add_argument("--overwrite", action="store_true", help=meaning)


def _add_jobs(parser: _Options) -> None:
    parser.add_argument(
        "--jobs", type=_positive, metavar="N", help="threads in all (default: all cores)"
    )


def _add_batch(parser: _Parser) -> None:
    """Add the options about several recipes."""
    parser.add_argument(
        "--fail-fast", action="store_true", help="start no other recipe once one has failed"
    )
    parser.add_argument(
        "--shard",
        type=_shard,
        metavar="I/N",
        help="build only every N-th recipe, from the I-th: on each of N machines another I",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="build on the Dask cluster of this scheduler, like tcp://10.0.0.5:8786",
    )


def _add_cache(parser: _Parser) -> None:
    parser.add_argument(
        "--cache",
        metavar="DIR|URL",
        help="take from there what others have built, and store it (default: FIRE_ATLAS_CACHE)",
    )
    parser.add_argument(
        "--cache-mode",
        choices=["read", "read-write"],
        metavar="MODE",
        help="read, or read-write (default: FIRE_ATLAS_CACHE_MODE, or read-write)",
    )


def _add_limits(parser: _Options) -> None:
    parser.add_argument(
        "--limit-pixels",
        type=_positive,
        default=DEFAULT_MAX_PIXELS,
        dest="max_pixels",
        metavar="N",
        help="refuse pictures of more pixels (default: 8192 x 8192)",
    )


def _add_set(
    parser: _Options, meaning: str = "change a key, like flakes.rate=80 or flakes=none"
) -> None:
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="overrides",
        metavar="KEY=VALUE",
        help=meaning,
    )


def _add_volume(parser: _Parser) -> None:
    volume = parser.add_mutually_exclusive_group()
    volume.add_argument("-q", "--quiet", action="store_true", help="print nothing but errors")
    volume.add_argument(
        "-v",
        "--verbose",
        action="count",
        default=0,
        help="print files and timings; -vv: tracebacks too",
    )


def path_of(text: str) -> "Path":
    """Return the path that an argument names."""
    from pathlib import Path  # --help does not import it

    return Path(text)


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number from 1; got {text}")
    return int(text)


def _shard(text: str) -> tuple[int, int]:
    number, _, count = text.partition("/")
    if not (number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
        raise argparse.ArgumentTypeError(f"must be like 1/4, from 1/4 to 4/4; got {text}")
    return int(number), int(count)


def _no_command(word: str, parsers: dict[str, _Parser]) -> str:
    from fire_atlas.recipe.document import RECIPE_ENDINGS
    from fire_atlas.recipe.problem import did_you_mean

    if word.startswith("-"):
        return f"{word}: put options after the command, like fire-atlas build {word}"
    if word.endswith(RECIPE_ENDINGS):
        return f"there is no command {word}; did you mean fire-atlas build {word}?"
    near = did_you_mean(word, parsers)
    return f"there is no command {word}{near or '; commands are ' + ', '.join(parsers)}"


def _refuse_rest(parser: _Parser, rest: list[str]) -> None:
    """Raise for arguments that the command does not have."""
    if not rest:
        return
    from fire_atlas.recipe.problem import did_you_mean

    option = rest[0].partition("=")[0]
    if not option.startswith("-"):
        raise RecipeError(f"one argument too many: {option} (see {parser.prog} --help)")
    known = re.findall(r"(?<![\w-])--?\w[\w-]*", parser.format_help())
    near = did_you_mean(option, known)
    raise RecipeError(f"there is no option {option}{near or f' (see {parser.prog} --help)'}")
