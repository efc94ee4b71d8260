"""The routes of the answering page, without a browser, and the port that it takes."""

import json
import socket
import threading
import time
import urllib.error
import urllib.request

import pytest
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from infthor_eval.pages.server import serve_pages
from model_adapters import Decoding, Notice, Turn
from model_adapters.human.desk import Desk, Inquiry
from model_adapters.human.serving import desk_routes

from ...helpers.command_line import assert_refused, option_words

LONG = "9" * 5000


@pytest.fixture
def frames(tmp_path):
    """A PNG file and a JPEG file that are named as pages, and a page that is named as an image."""
    paths = [tmp_path / name for name in ("a.html", "b.html", "c.png")]
    Image.new("RGB", (8, 8)).save(paths[0], format="PNG")
    Image.new("RGB", (8, 8)).save(paths[1], format="JPEG")
    paths[2].write_text("<script>alert(1)</script>")
    return [FrameRef(path) for path in paths]


@pytest.fixture
def get(frames):
    """Gets a path of the page of a question; its status, media type and content."""
    desk = Desk()
    inquiry = Inquiry((Turn("user", (*frames, "?")),), Decoding(max_new_tokens=5), Notice())
    asking = threading.Thread(target=_ask, args=(desk, inquiry), daemon=True)
    asking.start()
    with serve_pages(desk_routes(desk)) as server:

        def get(path):
            try:
                answer = urllib.request.urlopen(server.address + path)
            except urllib.error.HTTPError as error:
                answer = error
            with answer:
                return answer.status, answer.headers["Content-Type"], answer.read()

        while desk.question is None:
            pass
        yield get
        desk.stop()
        asking.join()


def _ask(desk, inquiry):
    with pytest.raises(KeyboardInterrupt):
        desk.ask(inquiry)


def test_a_frame_is_an_image_whatever_it_is_called(get, frames):
    assert get("frames/1/0") == (200, "image/png", frames[0].path.read_bytes())
    assert get("frames/1/1") == (200, "image/jpeg", frames[1].path.read_bytes())
    status, media_type, content = get("frames/1/2")
    assert (status, media_type) == (404, "application/json")
    assert b"script" not in content


@pytest.mark.parametrize("number", [LONG, "-1", "x", "3", "%D9%A3"])
def test_a_number_that_is_none_of_a_frame_is_refused(get, number):
    assert get(f"frames/1/{number}")[0] == 404
    assert get(f"frames/{number}/0")[0] == 409


@pytest.mark.parametrize("seen", [LONG, "x", ""])
def test_a_number_that_is_none_of_a_version_is_not_waited_for(get, seen):
    status, media_type, _ = get(f"state.json?seen={seen}")
    assert (status, media_type) == (200, "application/json")


def test_pages_that_wait_hold_up_no_answer(get):
    version = json.loads(get("state.json")[2])["version"]
    waiting = [
        threading.Thread(target=get, args=(f"state.json?seen={version}",), daemon=True)
        for _ in range(60)  # more than there are threads
    ]
    for thread in waiting:
        thread.start()
    time.sleep(0.5)
    assert all(thread.is_alive() for thread in waiting)
    start = time.monotonic()
    assert get("frames/1/0")[0] == 200  # from a thread, as answers are taken
    assert time.monotonic() - start < 10


def test_a_port_that_is_taken_ends_the_run_before_the_first_question(
    make_nieh_set, tmp_path, run_cli
):
    arguments = option_words(tasks="nieh_gt", data=make_nieh_set(size=56), out=tmp_path / "out")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        ended = run_cli(*arguments, "--model", f"human:browser=false,port={port}")
    assert_refused(ended, f"port {port}: cannot be had", after_notes=True)
    assert not list(tmp_path.rglob("worker-*.jsonl"))
