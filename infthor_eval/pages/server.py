"""A server of local pages: only for this machine, and who was given the address (`guard`)."""

from __future__ import annotations

import secrets
import socket
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from infthor_eval.errors import UsageError, wrap_errors
from infthor_eval.pages.one_file import read_part

if TYPE_CHECKING:
    from starlette.routing import BaseRoute, Route
    from uvicorn import Server

_HOST = "127.0.0.1"
_TOKEN_BYTES = 24
_STOP_WITHIN_S = 2  # for requests that are being answered when the server stops
_MEDIA_TYPES = {"html": "text/html", "css": "text/css", "js": "text/javascript"}


@dataclass(frozen=True)
class PageServer:
    """A server that is running.

    Attributes:
        address: address of its first page, with the token; ends in "/".
        port: its port on 127.0.0.1.
    """

    address: str
    port: int
    _thread: threading.Thread

    def wait(self) -> None:
        """Return when the server ends, which it does not by itself; Ctrl-C interrupts."""
        self._thread.join()


@contextmanager
def serve_pages(
    routes: Sequence[BaseRoute], *, port: int = 0, listening: socket.socket | None = None
) -> Iterator[PageServer]:
    """Serve pages from a thread until the context ends.

    Pages name their parts by relative addresses ("state.json"), which hold the token as the page's
    own does. Handlers that are plain functions run in other threads, several at a time.

    Args:
        routes: Starlette's routes; the one with path "/" is the first page.
        port: port on 127.0.0.1; 0 for a free one.
        listening: a socket of `listen` to use instead; it is closed at the end.
    """
    require_page_extra()
    token = secrets.token_urlsafe(_TOKEN_BYTES)
    with listening or listen(port) as taken:
        # Requests wait in the socket's queue from here on, so nobody must wait for the thread.
        port = taken.getsockname()[1]
        server = _server(routes, token)
        thread = threading.Thread(target=server.run, args=([taken],), name="pages", daemon=True)
        thread.start()
        try:
            yield PageServer(f"http://{_HOST}:{port}/{token}/", port, thread)
        finally:
            server.should_exit = True
            thread.join()


def file_route(path: str, package: str, name: str) -> Route:
    """Return the route of a package's file (.html, .css or .js): its path, and its location.

    Example: `file_route("/report.css", "infthor_eval.report.web", "report.css")`.
    """
    from starlette.responses import Response
    from starlette.routing import Route

    text = read_part(package, name)
    media_type = _MEDIA_TYPES[name.rpartition(".")[2]]
    return Route(path, lambda _request: Response(text, media_type=media_type))


def require_page_extra() -> None:
    """Import what pages need, so that a command says that it is missing before it begins."""
    problem = "a page needs Starlette and uvicorn"
    hint = "pip install 'infthor-eval[page]'"
    with wrap_errors(problem, hint, catch=ImportError, raise_as=UsageError):
        import starlette  # noqa: F401
        import uvicorn  # noqa: F401


def listen(port: int) -> socket.socket:
    """Take a port on 127.0.0.1, 0 for a free one, before there is something to serve on it."""
    problem = f"--port {port}: cannot be had"
    hint = "give another, or none for a free one"
    with wrap_errors(problem, hint, catch=(OSError, OverflowError), raise_as=UsageError):
        listening = socket.create_server((_HOST, port))
    # Connections inherit it. asyncio sets it for sockets of its own alone; without it each answer
    # to a kept connection waits 40 ms, as its second part is sent after the first one is confirmed.
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listening


def _server(routes: Sequence[BaseRoute], token: str) -> Server:
    from starlette.applications import Starlette
    from starlette.routing import Mount
    from uvicorn import Config, Server

    from infthor_eval.pages.guard import Guard

    config = Config(
        Guard(Starlette(routes=[Mount(f"/{token}", routes=routes)]), token),
        http="h11",
        ws="none",
        lifespan="off",
        proxy_headers=False,
        server_header=False,
        access_log=False,
        log_config=None,
        log_level="error",
        timeout_graceful_shutdown=_STOP_WITHIN_S,
    )
    return Server(config)
