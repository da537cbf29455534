"""A thread pool with results in input order.

Threads suffice: OpenCV, zlib-ng and numpy release the interpreter lock while they work.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Self, TypeVar

import cv2

from fire_atlas.core.cpu import default_jobs
from fire_atlas.core.memory import keep_freed_memory

Item = TypeVar("Item")
Result = TypeVar("Result")


class Workers:
    """A pool of ``jobs`` threads whose results come back in the order of their inputs."""

    def __init__(self, jobs: int | None) -> None:
        """Start the pool, by default with a worker for each CPU.

        Turns off OpenCV's own threads, on which results might depend, and lets the process keep the
        memory that workers free.
        """
        cv2.setNumThreads(1)
        keep_freed_memory()
        self.jobs = jobs or default_jobs()
        self._pool = ThreadPoolExecutor(self.jobs, thread_name_prefix="fire-atlas")

    def start(self, work: Callable[[], Result]) -> Future[Result]:
        """Start ``work`` in the pool.

        Use it also for long calls into C: while the main thread waits for the result it can handle
        signals, but not while it is inside such a call.
        """
        return self._pool.submit(work)

    def map(
        self, work: Callable[[Item], Result], items: Iterable[Item], ahead: int | None = None
    ) -> Iterator[Result]:
        """Yield ``work(item)`` for each item, in order.

        At most ``ahead`` items wait or are computed in advance, by default ``2 * jobs``.
        """
        most = 2 * self.jobs if ahead is None else ahead
        begun: deque[Future[Result]] = deque()
        try:
            for item in items:
                begun.append(self._pool.submit(work, item))
                if len(begun) > most:
                    yield begun.popleft().result()
            while begun:
                yield begun.popleft().result()
        finally:
            for future in begun:
                future.cancel()

    def __enter__(self) -> Self:
        """Return the pool; leaving the context shuts it down."""
        return self

    def __exit__(self, *_: object) -> None:
        """Wait for the running calls, and cancel those that have not started."""
        self._pool.shutdown(wait=True, cancel_futures=True)
