"""A server that takes connections, and falls silent."""

import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress

SILENCES = {
    "GET": b"",
    "mid-entry": b"HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\nfire.manifest.json",
    "PUT": b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n",
}
"""What a server answers to a GET before it falls silent, by what it leaves without an answer."""


@contextmanager
def silent_server(answer: bytes) -> Iterator[str]:
    """Run a server that sends ``answer`` to a GET, and else nothing ever; give the URL of a cache
    there."""
    ended = threading.Event()

    def serve(listener: socket.socket) -> None:
        with ExitStack() as connections:
            while not ended.is_set():
                with suppress(TimeoutError, ConnectionError):
                    connection = connections.enter_context(listener.accept()[0])
                    connection.settimeout(5)
                    if connection.recv(4) == b"GET ":
                        connection.sendall(answer)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(0.1)
        thread = threading.Thread(target=serve, args=[listener])
        thread.start()
        try:
            yield f"http://127.0.0.1:{listener.getsockname()[1]}/cache"
        finally:
            ended.set()
            thread.join()
