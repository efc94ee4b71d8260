"""Local pages answer who has the address, and nobody else."""

import http.client
import socket
import sys
import threading
import time
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.pages.server import PageServer, file_route, listen, serve_pages

pytest.importorskip(
    "uvicorn", reason="the extra `page` is not installed: pip install 'infthor-eval[page]'"
)
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.routing import Route

THREADS: list[str] = []


async def echo(request: Request) -> PlainTextResponse:
    return PlainTextResponse(await request.body())


def thread_name(_request: Request) -> PlainTextResponse:
    THREADS.append(threading.current_thread().name)
    return PlainTextResponse("first page")


def fail(_request: Request) -> PlainTextResponse:
    raise ValueError("the secret is 42")


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    routes = [Route("/", thread_name), Route("/echo", echo, methods=["POST"]), Route("/fail", fail)]
    with serve_pages(
        [*routes, file_route("/report.css", "infthor_eval.report.web", "report.css")]
    ) as running:
        yield running


def ask(
    server: PageServer,
    path: str | None = None,
    *,
    method: str = "GET",
    body: str | None = None,
    **headers: str,
) -> http.client.HTTPResponse:
    """The answer to a request; its path is one below the first page's, or any that begins with a
    slash."""
    first = urlsplit(server.address).path
    connection = http.client.HTTPConnection("127.0.0.1", server.port)
    path = first + (path or "") if not (path or "").startswith("/") else path
    connection.request(method, path, body=body, headers=headers)
    return connection.getresponse()


def test_who_has_the_address_gets_the_page(server: PageServer) -> None:
    assert server.address.startswith(f"http://127.0.0.1:{server.port}/")
    answer = ask(server)
    assert (answer.status, answer.read()) == (200, b"first page")
    assert "pages" not in THREADS  # a slow page stops no other


def test_what_is_posted_from_the_page_arrives(server: PageServer) -> None:
    answer = ask(
        server, "echo", method="POST", body="an apple", Origin=f"http://127.0.0.1:{server.port}"
    )
    assert (answer.status, answer.read()) == (200, b"an apple")


@pytest.mark.parametrize(
    "path", ["/", "/echo", "//", "/%2e%2e/", "/wrong/", "/%ff/", "/wrong/report.css", "/%C3%A9/"]
)
def test_another_token_is_refused(server: PageServer, path: str) -> None:
    answer = ask(server, path)
    assert answer.status == 403
    assert b"does not hold the token" in answer.read()


def test_part_of_the_token_is_refused(server: PageServer) -> None:
    path = urlsplit(server.address).path
    for near in (path[:-2] + "/", path[:-1] + "x/", path.swapcase()):
        assert ask(server, near).status == 403


@pytest.mark.parametrize(
    "origin",
    [
        "http://example.com",
        "null",
        "https://127.0.0.1:{port}",
        "http://localhost:{port}",
        "http://127.0.0.1:1",
    ],
)
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_another_origin_is_refused(server: PageServer, origin: str, method: str) -> None:
    path = "echo" if method == "POST" else ""
    answer = ask(server, path, method=method, Origin=origin.format(port=server.port))
    assert (answer.status, answer.read()) == (403, b"Refused: another page asked.\n")


@pytest.mark.parametrize(
    "host", ["example.com", "example.com:80", "127.0.0.1.example.com", "127.0.0.2", "[::1]", ""]
)
def test_another_host_is_refused(server: PageServer, host: str) -> None:
    answer = ask(server, Host=host)
    assert (answer.status, answer.read()) == (403, b"Refused: these pages are at 127.0.0.1.\n")


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1:9", "LOCALHOST:8000"])
def test_a_forwarded_port_is_not_another_host(server: PageServer, host: str) -> None:
    assert ask(server, Host=host).status == 200
    assert ask(server, Host=host, Origin=f"http://{host}").status == 200


@pytest.mark.parametrize("path", ["", "report.css", "nothing", "/wrong/", "fail"])
def test_every_answer_forbids_what_is_from_elsewhere(server: PageServer, path: str) -> None:
    headers = ask(server, path).headers
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; ")
    assert "unsafe" not in policy
    assert "require-trusted-types-for 'script'; trusted-types 'none'" in policy
    assert "http" not in policy
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Cache-Control"] == "no-store"


def test_a_file_of_a_package_has_its_type(server: PageServer) -> None:
    answer = ask(server, "report.css")
    assert answer.headers["Content-Type"] == "text/css; charset=utf-8"
    assert b"--paper" in answer.read()


def test_an_error_is_logged_and_tells_the_browser_nothing(
    server: PageServer, caplog: pytest.LogCaptureFixture
) -> None:
    answer = ask(server, "fail")
    assert (answer.status, answer.read()) == (500, b"Internal Server Error")
    for _ in range(1000):  # it is logged after the answer is sent
        if "the secret is 42" in caplog.text:
            return
        time.sleep(0.01)
    pytest.fail("the error is not logged")


def test_other_machines_cannot_reach_it(server: PageServer) -> None:
    try:
        (own,) = {
            info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)
        }
    except (OSError, ValueError):
        pytest.skip("this machine has no address, or several")
    if own == "127.0.0.1":
        pytest.skip("this machine has no address of its own")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((own, server.port))


def test_it_ends_with_its_context_and_frees_its_port() -> None:
    with serve_pages([Route("/", thread_name)]) as first:
        kept = http.client.HTTPConnection("127.0.0.1", first.port)
        kept.request("GET", urlsplit(first.address).path)  # kept open, as a browser does
        assert kept.getresponse().status == 200
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", first.port))
    with serve_pages([Route("/", thread_name)], port=first.port) as second:
        assert second.port == first.port
        assert second.address != first.address  # a new token
        assert ask(second).status == 200


def test_no_answer_waits_for_the_one_before_it_to_be_confirmed() -> None:
    with listen(0) as listening:
        client = socket.create_connection(listening.getsockname())
        accepted = listening.accept()[0]
        with client, accepted:
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_a_port_that_is_taken_is_an_error_of_one_line(server: PageServer) -> None:
    for port in (server.port, 65536):
        with (
            pytest.raises(
                UsageError,
                match=rf"--port {port}: cannot be had .*; give another, or none for a free one",
            ),
            serve_pages([], port=port),
        ):
            pass


def test_without_the_extra_there_is_an_error_of_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    with pytest.raises(
        UsageError, match=r"Starlette and uvicorn .*pip install 'infthor-eval\[page\]'"
    ):
        serve_pages([]).__enter__()
