"""Queue of requests from a link's thread to the loop of a program."""

import contextlib
import queue
from collections import deque
from typing import Generic, TypeVar

Item = TypeVar("Item")


class RequestQueue(Generic[Item]):
    """Thread-safe queue of requests from a link's thread to the control loop."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Item] = queue.SimpleQueue()
        self._ready: deque[Item] = deque()  # taken from the queue by `wait`

    def __len__(self) -> int:
        return self._queue.qsize() + len(self._ready)

    def put(self, item: Item) -> None:
        """Add a request; callable from any thread."""
        self._queue.put(item)

    def take(self) -> list[Item]:
        """Return all requests, oldest first, without waiting."""
        items = [*self._ready, *(self._queue.get() for _ in range(self._queue.qsize()))]
        self._ready.clear()
        return items

    def wait(self, timeout_s: float) -> Item | None:
        """Return the oldest request, which stays, as soon as there is one; None: not in time."""
        if not self._ready:
            with contextlib.suppress(queue.Empty):
                self._ready.append(self._queue.get(timeout=max(timeout_s, 0.0)))
        return self._ready[0] if self._ready else None
