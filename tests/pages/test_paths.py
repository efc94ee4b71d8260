"""Whatever path is asked for, a page's server has its pages, its run and its frames, and no other
file."""

import random
import re
import socket
import threading
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote, urlsplit

import pytest
from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.records import RECORDS
from infthor_eval.pages.server import PageServer, require_page_extra, serve_pages
from infthor_eval.report.live.state import LiveRun
from infthor_eval.runs.journals.journal import Journal
from model_adapters import Decoding, Notice, Turn
from model_adapters.human.desk import Desk, Inquiry

from ..helpers.nieh_runs import make_config, make_header, make_record
from ..helpers.waiting import wait_until

try:
    require_page_extra()
except UsageError as error:
    pytest.skip(str(error), allow_module_level=True)
from infthor_eval.report.live.state import live_routes
from model_adapters.human.serving import desk_routes

N_PATHS = 10_000
SECRET = "a line that no page may show"
NAMES = (
    "state.json", "report.css", "live.js", "page.js", "answer", "frames", "0", "1", "2", "journal",
    "worker-0.jsonl", "secret.txt", "notes.html", "results", "m", "img", "..", ".", "", "~", "etc",
    "passwd", "proc", "self", "environ", "guard.py", "__init__.py", "C:", "file:", "index.html",
)  # fmt: skip
WRITINGS = (
    lambda text: text,
    quote,
    lambda text: quote(text, safe=""),
    lambda text: quote(quote(text, safe=""), safe=""),
    lambda text: "".join(f"%{ord(letter):02x}" for letter in text),
    lambda text: text.replace(".", "%c0%ae"),
    lambda text: text.replace(".", "\u2024").encode().decode("latin-1"),
    str.upper,
)
SLASHES = ("/", "/", "/", "//", "\\", "%2f", "%5c", "%252f", "/./", ";/", "?/", "#/")
ENDS = ("", "", "/", "%00", "%00.css", "?seen=1", "?x=../../secret.txt", ".", "..", "%0d%0aX:%20y")


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run with files beside it, above it and within it that are nobody's business."""
    folder = tmp_path / "results" / "m" / "run"
    header = make_header(make_config(model="m", checkpoint=None, n_parameters=None))
    with Journal(folder, header, RECORDS, 0) as journal:
        journal.append(make_record(0, "Sofa", ("Sofa",)))
    for place in (tmp_path, folder.parent, folder):
        for name in ("secret.txt", "notes.html", "index.html"):
            (place / name).write_text(SECRET)
    return folder


@pytest.fixture(params=["live", "desk"])
def server(request: pytest.FixtureRequest, run: Path) -> Iterator[PageServer]:
    """The server of the page on the run, and that of a person's page with a frame from it."""
    if request.param == "live":
        with serve_pages(live_routes(LiveRun(run.parent))) as running:
            yield running
        return
    frame = run / "img.png"
    Image.new("RGB", (8, 8)).save(frame)
    desk = Desk()
    inquiry = Inquiry((Turn("user", (FrameRef(frame), "?")),), Decoding(max_new_tokens=5), Notice())
    asking = threading.Thread(target=_ask, args=(desk, inquiry), daemon=True)
    asking.start()
    with serve_pages(desk_routes(desk)) as running:
        wait_until(lambda: desk.question is not None)
        yield running
        desk.stop()
        asking.join()


def _ask(desk: Desk, inquiry: Inquiry) -> None:
    with pytest.raises(KeyboardInterrupt):
        desk.ask(inquiry)


def make_paths(first: str, folder: Path, seed: int) -> Iterator[str]:
    """Paths below the first page's: what is there, what is not, and every way up that there is."""
    rng = random.Random(seed)
    whole = [str(folder / "secret.txt"), "/etc/passwd", str(Path(__file__))]
    for text in ("", "state.json", "frames/1/0", "../secret.txt", *(path[1:] for path in whole)):
        yield first + text
    while True:
        if rng.random() < 0.1:
            text = rng.choice(WRITINGS)(rng.choice(whole))
        else:
            n_parts = rng.randint(1, 6)
            ups = rng.choice((0, 0, 1, 3, 8))
            parts = [".."] * ups + [rng.choice(NAMES) for _ in range(n_parts)]
            slash = rng.choice(SLASHES)
            text = slash.join(rng.choice(WRITINGS)(part) for part in parts)
        path = first + text + rng.choice(ENDS)
        yield re.sub(r"[^\x21-\xff]", "", path)  # a space would end the path


class Client:
    """Sends paths as they are: clients of the library would mend or refuse them."""

    def __init__(self, server: PageServer) -> None:
        self._port = server.port
        self._open()

    def _open(self) -> None:
        self._socket = socket.create_connection(("127.0.0.1", self._port))
        self._file = self._socket.makefile("rb")

    def ask(self, path: str) -> tuple[int, dict[str, str], bytes]:
        request = f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{self._port}\r\n\r\n"
        self._socket.sendall(request.encode("latin-1"))
        status = int(self._file.readline().split()[1])
        lines = iter(lambda: self._file.readline().decode("latin-1").strip(), "")
        headers = {
            name.lower(): value for name, _, value in (line.partition(": ") for line in lines)
        }
        if "content-length" in headers:
            return status, headers, self._file.read(int(headers["content-length"]))
        content = self._file.read()  # it is no path at all: the server ends the connection
        self.close()
        self._open()
        return status, headers, content

    def close(self) -> None:
        self._file.close()
        self._socket.close()


@pytest.fixture
def client(server: PageServer) -> Iterator[Client]:
    opened = Client(server)
    yield opened
    opened.close()


def test_no_path_leads_to_a_file_outside_the_run(
    server: PageServer, client: Client, run: Path, tmp_path: Path
) -> None:
    statuses: Counter[int] = Counter()
    shown: set[str] = set()
    paths = make_paths(urlsplit(server.address).path, tmp_path, seed=1)
    for _ in range(N_PATHS // 2):
        path = next(paths)
        status, headers, content = client.ask(path)
        statuses[status] += 1
        assert SECRET.encode() not in content and b"root:x:" not in content, path
        if status == 400:
            assert b"Invalid HTTP request received." in content, path
            continue
        assert headers["content-security-policy"].startswith("default-src 'none'"), path
        assert headers["x-content-type-options"] == "nosniff"
        if status == 200:
            shown.add(headers["content-type"].partition(";")[0])
            files = (run / "journal" / "worker-0.jsonl", Path(__file__))
            assert not any(file.read_bytes() == content for file in files), path
        elif status in (307, 308):  # to the same path with or without a slash
            assert urlsplit(headers["location"]).netloc == f"127.0.0.1:{server.port}", path
        else:
            assert status in (403, 404, 405, 409), path
    assert statuses[200] > 20 and statuses[404] > N_PATHS // 4
    # A browser runs none of these as a script but the pages' own.
    assert shown <= {
        "text/html", "text/css", "text/javascript", "application/json", "image/png",
    }  # fmt: skip


@pytest.mark.parametrize("up", ["..", "%2e%2e", "..%2f", "frames/../.."])
def test_above_the_token_there_is_nothing(server: PageServer, client: Client, up: str) -> None:
    first = urlsplit(server.address).path
    for path in (f"{first}{up}/state.json", f"/{up}{first}state.json"):
        assert client.ask(path)[0] in (403, 404, 409)
