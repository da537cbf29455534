"""What runs on the workers of a Dask cluster: a check of the tool there, and builds.

The check is sent to workers as code, as they may have another version of fire-atlas or none. So
this module imports nothing of the tool until it is known to be the same.
"""

import asyncio
import json
import subprocess
import sys
from typing import TYPE_CHECKING, cast

from distributed import Worker, WorkerPlugin, get_worker

if TYPE_CHECKING:
    from fire_atlas.cli.side_by_side import BuildEvent

_IDENTITY = """
from fire_atlas.core.cpu import cpu_class
from fire_atlas.outputs.digest import tool_digest
print(tool_digest(), cpu_class())
"""
"""Prints what the bytes of an output depend on besides recipe and inputs."""


class WorkerCheck(WorkerPlugin):
    """Gives a resource to each worker, present or future, that writes the same bytes as the client.

    Recipes need this resource, so Dask hands them to no other worker.
    """

    def __init__(self, identity: str, resource: str, topic: str) -> None:
        """Give ``resource`` to workers with this ``identity``; report the others to ``topic``."""
        self.name = topic  # of this command alone, as others may use the cluster too
        self._identity = identity
        self._resource = resource
        self._topic = topic
        self.refusal: str | None = None

    async def setup(self, worker: Worker) -> None:
        """Check one worker."""
        reason = await asyncio.to_thread(why_refused, self._identity)
        threads = worker.state.nthreads
        await worker.set_resources(**{self._resource: 0 if reason else threads})
        if reason:
            self.refusal = f"worker {worker.name} gets no recipes: {reason}"
            worker.log_event(self._topic, ("", {"event": "refused", "message": self.refusal}))
        else:
            accepted = {"event": "accepted", "address": worker.address, "name": worker.name}
            worker.log_event(self._topic, ("", accepted))


def refusal(topic: str, dask_worker: Worker) -> str | None:
    """Return why the worker that runs this gets no recipes; None if it gets some."""
    check = cast(WorkerCheck, dask_worker.plugins[topic])
    return check.refusal


def why_refused(identity: str) -> str | None:
    """Return why this machine's fire-atlas would not write the same bytes; None if it would."""
    done = subprocess.run(
        [sys.executable, "-P", "-c", _IDENTITY], capture_output=True, text=True, check=False
    )
    if done.returncode:
        last = done.stderr.strip().rpartition("\n")[2]
        return f"its fire-atlas cannot be run or has another version ({last})"
    (tool, cpu), (own_tool, own_cpu) = identity.split(), done.stdout.split()
    if tool != own_tool:
        return (
            "its fire-atlas or one of its libraries has another version; install the same "
            "packages on all machines"
        )
    return None if cpu == own_cpu else f"its CPU is of class {own_cpu}, not {cpu}"


def build_on_worker(recipe: str, arguments: list[str], topic: str) -> "list[BuildEvent]":
    """Build a recipe in a process of its own; return its events but for the stages it reaches.

    These are sent to ``topic`` as they come. The process ends with the worker, and at its next
    event if the client has gone.
    """
    from fire_atlas.cli.processes import how_it_ended
    from fire_atlas.core.process import start_module

    worker = get_worker()
    task = worker.get_current_task()
    with start_module("fire_atlas.cli.build_process") as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps(arguments).encode() + b"\n")
        process.stdin.flush()
        events: list[BuildEvent] = []
        for line in process.stdout:
            event = json.loads(line)
            if event["event"] == "stage":
                worker.log_event(topic, (recipe, event))
            else:
                events.append(event)
            if event["event"] == "exit":
                process.kill()  # it would only wait for more recipes
                return events
            if worker.state.tasks[task].state == "cancelled":
                process.terminate()  # it removes its temporary files
                return events
        message = f"{how_it_ended(process.wait())} (on worker {worker.name})"
        return [*events, {"event": "lost", "message": message}]
