"""Build recipes on a Dask cluster that exists already."""

import logging
import os
from argparse import Namespace
from collections.abc import Container, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Self

import cloudpickle
from distributed import Client, Future

from fire_atlas.cli import cluster_worker
from fire_atlas.cli.cluster_worker import (
    WorkerCheck,
    build_on_worker,
    refusal,
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
        for name in ("distributed", "distributed.client"):  # errors are reported by us
            logging.getLogger(name).setLevel(logging.CRITICAL)
        cloudpickle.register_pickle_by_value(cluster_worker)
        out = args.out and absolute(Path(args.out))
        cache = args.cache
        if cache and "://" not in cache:
            cache = str(absolute(Path(cache)))
        self._args = Namespace(**{**vars(args), "out": out, "cache": cache})
        self._view = view
        self._topic = f"fire-atlas-{os.urandom(8).hex()}"
        self._events: SimpleQueue[tuple[str, BuildEvent]] = SimpleQueue()
        self._handed: dict[str, _Handed] = {}
        self._count = count()
        self._workers: dict[str, str] = {}
        self._first_workers: set[str] = set()
        self._stack = ExitStack()
        self._address = address
        self._client = _connected(address)
        self._client.subscribe_topic(self._topic, lambda event: self._events.put(event[1]))
        self._client.subscribe_topic("all", self._note_removal)
        self._identity = f"{tool_digest()} {cpu_class()}"
        self._resource = f"fire-atlas {self._identity}"

    def start(self, recipe: Path, unfinished: int, failed: Container[str]) -> None:
        """Hand a recipe to the scheduler, to be built with one thread."""
        self._submit(recipe, build_arguments(absolute(recipe), self._args, 1, failed))

    def _submit(self, recipe: Path, arguments: list[str]) -> None:
        topic, number = self._topic, next(self._count)
        key = f"{topic}-{number}"
        future = self._client.submit(
            # Dask sends a lambda as code: the scheduler, who reads it, need not have fire-atlas.
            lambda: build_on_worker(key, arguments, topic),
            key=key,
            resources={self._resource: 1},
            priority=-number,  # in their order
        )
        self._handed[key] = _Handed(recipe, arguments, future)
        future.add_done_callback(self._report_end)

    def receive(self) -> tuple[Path, BuildEvent]:
        """Wait for the next event of any build, and return it with the recipe."""
        while True:
            key, event = self._events.get()
            match event["event"]:
                case "refused":
                    self._view.remark(event["message"])
                case "accepted":
                    self._accept(event["address"], event["name"])
                case "removed":
                    self._forget(event["address"])
                case _ if key in self._handed:
                    break
        if event["event"] in {"exit", "lost"}:
            return self._handed.pop(key).recipe, event
        return self._handed[key].recipe, event

    def _accept(self, address: str, name: str) -> None:
        """Note that a worker builds, and hand out again what no worker has, if it comes late.

        Dask itself looks for a worker only when one comes, a moment before that is accepted.
        """
        self._workers[address] = name
        if address in self._first_workers:
            return
        taken = {key for keys in self._client.processing().values() for key in keys}
        waiting = {
            key: handed
            for key, handed in self._handed.items()
            if key not in taken and not handed.future.done()
        }
        self._client.cancel([handed.future for handed in waiting.values()])
        for key, handed in waiting.items():
            del self._handed[key]
            self._submit(handed.recipe, handed.arguments)

    def _forget(self, address: str) -> None:
        """Say that a worker that built is gone."""
        if name := self._workers.pop(address, None):
            then = (
                "its recipes go to others"
                if self._workers
                else f"no other can build: waits until one comes (`dask worker {self._address}`)"
            )
            self._view.remark(f"worker {name} is gone; {then}")

    def __enter__(self) -> Self:
        """Check the workers; leaving the context ends the builds and the connection.

        Raises:
            OutputError: None of the workers can build, or the scheduler is gone.
        """
        with ExitStack() as stack:
            stack.callback(self._disconnect)
            check = WorkerCheck(self._identity, self._resource, self._topic)
            try:
                self._client.register_plugin(check)
                refusals = self._client.run(refusal, self._topic)
            except OSError as error:
                raise OutputError(f"{self._scheduler_is_gone()} ({error})") from error
            _require_worker(refusals)
            self._first_workers = {address for address, why in refusals.items() if why is None}
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """Forget unfinished recipes, and disconnect."""
        self._handed.clear()
        self._stack.close()

    def _disconnect(self) -> None:
        if self._client.status == "running":  # else the scheduler is gone, which was said
            with suppress(OSError):
                self._client.unregister_worker_plugin(self._topic)
        self._client.close()

    def _note_removal(self, event: tuple[float, Any]) -> None:
        """Note what a scheduler tells of all that happens, if a worker is gone."""
        match event:
            case (_, {"action": "remove-worker", "worker": address}):
                self._events.put(("", {"event": "removed", "address": address}))

    def _report_end(self, future: "Future[list[BuildEvent]]") -> None:
        """Report how a build has ended, or that the cluster has given it up."""
        match future.status:
            case "finished":
                for event in future.result():
                    self._events.put((str(future.key), event))
                return
            case "cancelled":
                message = self._scheduler_is_gone()
            case _:
                message = f"the cluster has given it up: {future.exception()}"
        self._events.put((str(future.key), {"event": "lost", "message": message}))

    def _scheduler_is_gone(self) -> str:
        return (
            f"the Dask scheduler at {self._address} is gone, or was started anew; run the command "
            f"again when it is there"
        )


@dataclass(frozen=True, slots=True)
class _Handed:
    """A recipe that was handed to the scheduler.

    Attributes:
        recipe: Its path.
        arguments: Of the build.
        future: What the build will return.
    """

    recipe: Path
    arguments: list[str]
    future: "Future[list[BuildEvent]]"


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
