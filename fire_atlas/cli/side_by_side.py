"""Build several recipes at the same time, by whatever builds them, and show what happens."""

import os
from argparse import Namespace
from collections import deque
from collections.abc import Container, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from fire_atlas.cli.failure import Failures
from fire_atlas.cli.plan import Plan, refuse_unbuilt
from fire_atlas.cli.progress import BuildView
from fire_atlas.core.errors import OutputError
from fire_atlas.outputs.cache.build_cache import NOT_READ, NOT_WRITTEN
from fire_atlas.outputs.outcome import Outcome
from fire_atlas.recipe.tree import RecipeTree

BuildEvent: TypeAlias = dict[str, Any]
"""A line of ``build --json``; or, as the last one of a build, one of these two.

``exit``: the build has ended; ``code``, and ``errors``: what it printed on stderr.
``lost``: the process that built the recipe is no more; ``message`` says what happened to it.
"""


class Builder(Protocol):
    """Builds recipes at the same time and reports their events as they come."""

    @property
    def has_room(self) -> bool:
        """Whether another recipe can be started now."""

    def start(self, recipe: Path, unfinished: int, failed: Container[str]) -> None:
        """Start a build; ``unfinished`` recipes, this one included, are not built yet, and
        ``failed`` is what the cache cannot be used for any more."""

    def receive(self) -> tuple[Path, BuildEvent]:
        """Wait for the next event of any build, and return it with the recipe."""


def build_arguments(recipe: Path, args: Namespace, jobs: int, failed: Container[str]) -> list[str]:
    """Return the arguments of the ``build`` of one recipe, with the options in ``args``.

    ``failed`` says how the cache has failed other builds, ``NOT_READ`` or ``NOT_WRITTEN``: whoever
    builds this one does not wait for it again.
    """
    cache = "" if NOT_READ in failed else args.cache
    mode = "read" if NOT_WRITTEN in failed else args.cache_mode
    chosen = {
        f"--out={args.out}": args.out,
        f"--cache={cache}": cache is not None,
        f"--cache-mode={mode}": mode,
        "--overwrite": args.overwrite,
        "--force": args.force,
        "-vv": args.verbose > 1,
    }
    return [
        os.path.join(".", recipe),  # noqa: PTH118 - a name that begins with a dash is no option
        "--json",
        f"--jobs={jobs}",
        f"--limit-pixels={args.max_pixels}",
        *(f"--set={override}" for override in args.overrides),
        *(option for option, is_chosen in chosen.items() if is_chosen),
    ]


@dataclass(slots=True)
class _Playback:
    """Shows the JSON events of one build that runs elsewhere.

    Attributes:
        view: Shows the builds.
        recipe: The recipe that is built.
        reported: What was said of a cache that failed; each process that builds says it anew.
        steps: Number of steps done of the stage.
    """

    view: BuildView
    recipe: Path
    reported: set[str]
    steps: int = 0

    def show(self, event: BuildEvent) -> None:
        """Show one event."""
        self.view.begin(self.recipe)
        match event:
            case {"event": "stage", "done": 0}:
                self.view.stage(event["stage"], event["total"])
                self.steps = 0
            case {"event": "stage"}:
                self.view.advance(event["done"] - self.steps)
                self.steps = event["done"]
            case {"event": "note"}:
                self._note(event["message"])
            case {"event": "cache"}:
                self.view.cache(event["result"], event["why"])
            case {"event": "done"}:
                files = [Path(name) for name in event["files"]]
                timings, statistics = event["timings"], event["statistics"]
                self.view.done(Outcome(files, timings, statistics, event["fresh"]))
            case {"event": "error"}:
                self.view.failed(event["message"])

    def _note(self, message: str) -> None:
        end = message.rpartition("; ")[2]
        if end not in self.reported:
            self.view.note(message)
        if end in (NOT_READ, NOT_WRITTEN):
            self.reported.add(end)


def build_side_by_side(
    stale: Sequence[RecipeTree],
    plan: Plan,
    builder: Builder,
    view: BuildView,
    failures: Failures,
) -> list[RecipeTree]:
    """Build recipes, each after those whose outputs it reads; return those that succeeded.

    After a failure with ``--fail-fast`` no other recipe is started; the running ones are finished.
    """
    left = {tree.path: tree for tree in stale}
    order = TopologicalSorter({path: left.keys() & plan.before[path] for path in left})
    order.prepare()
    waiting, running, reported = deque[Path](), dict[Path, _Playback](), set[str]()
    built = []
    while True:
        waiting.extend(order.get_ready())
        while waiting and builder.has_room and not failures.must_stop:
            path = waiting.popleft()
            running[path] = _Playback(view, path, reported)
            builder.start(path, len(running) + len(waiting), reported)
        if not running:
            break
        path, event = builder.receive()
        running[path].show(event)
        if event["event"] in {"exit", "lost"}:
            del running[path]
            if _has_succeeded(path, event, failures):
                order.done(path)
                built.append(left.pop(path))
    if not failures.must_stop:
        _report_left_out(list(left.values()), plan, view, failures)
    return built


def _has_succeeded(path: Path, last: BuildEvent, failures: Failures) -> bool:
    """Report the end of a build; return whether it succeeded."""
    if last["event"] == "lost":
        with failures.caught():
            raise OutputError(f"{path}: {last['message']}")
        return False
    failures.add(last["code"], last["errors"])
    return bool(last["code"] == 0)


def _report_left_out(
    left: Sequence[RecipeTree], plan: Plan, view: BuildView, failures: Failures
) -> None:
    """Report the recipes that could not be started because others, among ``left``, have failed."""
    paths = {tree.path for tree in left}
    for tree in left:
        if paths.intersection(plan.before[tree.path]):
            view.begin(tree.path)
            with failures.caught():
                refuse_unbuilt(tree, plan, plan.before.keys() - paths)
