"""Build recipes on a Dask cluster that exists already."""

import logging
import os
from argparse import Namespace
from collections.abc import Container, Mapping
from contextlib import ExitStack
from pathlib import Path
from queue import SimpleQueue
from typing import Self

import cloudpickle
from distributed import Client, Future

from fire_atlas.cli import cluster_worker
from fire_atlas.cli.cluster_worker import (
    WorkerCheck,
    build_on_worker,
    refusal,
    schedule_again,
)
from fire_atlas.cli.progress import BuildView
from fire_atlas.cli.side_by_side import BuildEvent, build_arguments
from fire_atlas.core.cpu import cpu_class
from fire_atlas.core.errors import OutputError
from fire_atlas.core.files import absolute
from fire_atlas.outputs.digest import tool_digest

_SECONDS = 10
"""Seconds to wait for the scheduler's answer."""


class ClusterBuilder:
    """A ``Builder`` that hands recipes to the workers of a Dask scheduler, as many as they can do.

    Dask decides which worker builds what, and gives the recipes of a lost worker to others. Workers
    find recipes and inputs, and leave the outputs, under the same paths as this machine.
    """

    has_room = True

    def __init__(self, address: str, args: Namespace, view: BuildView) -> None:
        """Connect to the scheduler at ``address``.

        Raises:
            OutputError: No scheduler answers.
        """
        logging.getLogger("distributed").setLevel(logging.CRITICAL)  # errors are reported by us
        cloudpickle.register_pickle_by_value(cluster_worker)
        out = args.out and absolute(Path(args.out))
        cache = args.cache
        if cache and "://" not in cache:
            cache = str(absolute(Path(cache)))
        self._args = Namespace(**{**vars(args), "out": out, "cache": cache})
        self._view = view
        self._topic = f"fire-atlas-{os.urandom(8).hex()}"
        self._events: SimpleQueue[tuple[str, BuildEvent]] = SimpleQueue()
        self._recipes: dict[str, Path] = {}
        self._futures: dict[str, Future[list[BuildEvent]]] = {}
        self._stack = ExitStack()
        self._client = _connected(address)
        self._client.subscribe_topic(self._topic, lambda event: self._events.put(event[1]))
        self._identity = f"{tool_digest()} {cpu_class()}"
        self._resource = f"fire-atlas {self._identity}"

    def start(self, recipe: Path, unfinished: int, failed: Container[str]) -> None:
        """Hand a recipe to the scheduler, to be built with one thread."""
        shared = absolute(recipe)
        topic = self._topic
        key = f"{topic}-{len(self._recipes)}"
        self._recipes[key] = recipe
        arguments = build_arguments(shared, self._args, 1, failed)
        self._futures[key] = self._client.submit(
            # Dask sends a lambda as code: the scheduler, who reads it, need not have fire-atlas.
            lambda: build_on_worker(key, arguments, topic),
            key=key,
            resources={self._resource: 1},
            priority=-len(self._recipes),  # in their order
        )
        self._futures[key].add_done_callback(self._report_end)

    def receive(self) -> tuple[Path, BuildEvent]:
        """Wait for the next event of any build, and return it with the recipe."""
        while True:
            key, event = self._events.get()
            if event["event"] == "refused":
                self._view.remark(event["message"])
            elif event["event"] == "accepted":
                self._client.run_on_scheduler(schedule_again)
            elif key in self._futures:
                break
        if event["event"] in {"exit", "lost"}:
            del self._futures[key]
        return self._recipes[key], event

    def __enter__(self) -> Self:
        """Check the workers; leaving the context ends the builds and the connection.

        Raises:
            OutputError: None of the workers can build.
        """
        with ExitStack() as stack:
            stack.callback(self._client.close)
            self._client.register_plugin(WorkerCheck(self._identity, self._resource, self._topic))
            stack.callback(self._client.unregister_worker_plugin, self._topic)
            _require_worker(self._client.run(refusal, self._topic))
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """Forget unfinished recipes, and disconnect."""
        self._futures.clear()
        self._stack.close()

    def _report_end(self, future: "Future[list[BuildEvent]]") -> None:
        """Report how a build has ended, or that the cluster has given it up."""
        if future.status == "finished":
            events = future.result()
        else:
            message = f"the cluster has given it up: {future.exception() or future.status}"
            events = [{"event": "lost", "message": message}]
        for event in events:
            self._events.put((str(future.key), event))


def _require_worker(refusals: Mapping[str, str | None]) -> None:
    """Raise ``OutputError`` if each worker, by its address, was refused for a reason."""
    if not refusals:
        raise OutputError("--scheduler: it has no workers; start some with `dask worker ADDRESS`")
    if None not in refusals.values():
        raise OutputError(*sorted(filter(None, refusals.values())))


def _connected(address: str) -> "Client":
    try:
        return Client(address, timeout=_SECONDS)
    except (OSError, ValueError) as error:
        raise OutputError(
            f"--scheduler {address}: no Dask scheduler answers there ({error}); start one with "
            f"`dask scheduler`, and workers with `dask worker {address}`"
        ) from error
