"""Frames are ready before the model asks for them: in order, in bounded memory, each with its own
error."""

import threading
import time
from pathlib import Path

import pytest
import torch

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from model_adapters.hf.prompting.ahead import Ahead, PixelsAhead
from model_adapters.hf.prompting.prompt import Frame

_BYTES = 400  # of the pixels of a frame
_WAIT_S = 20.0


def _frames(n):
    return [Frame(str(at), (1, 1), (), FrameRef(Path(f"{at}.png"))) for at in range(n)]


def _pixels(piece):
    assert isinstance(piece, Frame)
    return {"pixel_values": torch.full((_BYTES // 4,), int(piece.digest), dtype=torch.float32)}


def _number(pixels):
    return int(pixels["pixel_values"][0])


class _Reader:
    """Makes pixels, and remembers of which frames; the threads that do so wait for `go`."""

    def __init__(self):
        self.read = []
        self.go = threading.Event()
        self.broken = set()

    def __call__(self, piece):
        assert isinstance(piece, Frame)
        number = int(piece.digest)
        self.read.append(number)
        assert self.go.wait(_WAIT_S)
        if number in self.broken:
            raise DataError(f"{piece.ref.path}: not a readable image")
        return _pixels(piece)

    def wait_for(self, n_read):
        end = time.monotonic() + _WAIT_S
        while len(self.read) < n_read and time.monotonic() < end:
            time.sleep(0.001)
        assert len(self.read) == n_read


def _n_threads():
    return sum(thread.name.startswith("frames") for thread in threading.enumerate())


@pytest.fixture
def reader(monkeypatch):
    all_threads = threading.enumerate
    others = {*all_threads()}  # of models that other tests have loaded
    monkeypatch.setattr(threading, "enumerate", lambda: [*{*all_threads()} - others])
    reader = _Reader()
    yield reader
    reader.go.set()
    assert not _n_threads()


def test_frames_come_in_the_order_they_are_asked_for(reader):
    frames = _frames(40)
    ahead = PixelsAhead(reader, Ahead(n_threads=3))
    reader.go.set()
    ahead.expect(frames)
    assert [_number(ahead.take(frame)) for frame in frames] == list(range(40))
    assert sorted(reader.read) == list(range(40))  # each is read once
    ahead.close()


def test_frames_are_read_before_they_are_asked_for(reader):
    ahead = PixelsAhead(reader, Ahead(n_threads=2))
    ahead.expect(_frames(5))
    reader.wait_for(2)
    reader.go.set()
    ahead.take(_frames(1)[0])
    reader.wait_for(5)
    ahead.close()


def test_no_more_frames_wait_than_memory_allows(reader):
    frames = _frames(30)
    ahead = PixelsAhead(reader, Ahead(n_threads=2, max_bytes=6 * _BYTES + 1))
    reader.go.set()
    ahead.expect(frames)
    for n_taken, frame in enumerate(frames, 1):
        ahead.take(frame)
        reader.wait_for(min(30, n_taken + 6))
    ahead.close()


def test_a_frame_that_is_larger_than_the_memory_is_read_all_the_same(reader):
    frames = _frames(6)
    ahead = PixelsAhead(reader, Ahead(n_threads=2, max_bytes=0))
    reader.go.set()
    ahead.expect(frames)
    assert [_number(ahead.take(frame)) for frame in frames] == list(range(6))
    ahead.close()


def test_a_broken_frame_raises_its_own_error_when_it_is_asked_for(reader):
    frames = _frames(6)
    reader.broken = {2, 4}
    reader.go.set()
    ahead = PixelsAhead(reader, Ahead(n_threads=3))
    ahead.expect(frames)
    assert [_number(ahead.take(frame)) for frame in frames[:2]] == [0, 1]
    with pytest.raises(DataError, match=r"2\.png: not a readable image"):
        ahead.take(frames[2])
    # A prompt without it begins anew.
    others = [frames[0], frames[3], frames[5]]
    ahead.expect(others)
    assert [_number(ahead.take(frame)) for frame in others] == [0, 3, 5]
    ahead.close()


@pytest.mark.parametrize("n_threads", [0, 2])
def test_frames_that_nobody_expected_are_read_when_they_are_asked_for(n_threads, reader):
    frames = _frames(4)
    reader.go.set()
    ahead = PixelsAhead(reader, Ahead(n_threads))
    ahead.expect(frames[:2])
    assert [_number(ahead.take(frame)) for frame in reversed(frames)] == [3, 2, 1, 0]
    ahead.close()


def test_one_frame_starts_no_thread(reader):
    reader.go.set()
    ahead = PixelsAhead(reader, Ahead(n_threads=2))
    ahead.expect(_frames(1))
    assert not _n_threads()
    ahead.take(_frames(1)[0])
    ahead.close()


def test_an_interrupted_run_leaves_no_thread(reader):
    ahead = PixelsAhead(reader, Ahead(n_threads=2, max_bytes=2**20))
    frames = _frames(50)
    ahead.expect(frames)
    reader.wait_for(2)
    reader.go.set()
    with pytest.raises(KeyboardInterrupt):
        for frame in frames:
            ahead.take(frame)
            raise KeyboardInterrupt
    ahead.close()
    assert not _n_threads()
    assert len(reader.read) < 50 or sorted(reader.read) == list(range(50))


def test_torch_computes_in_one_thread_beside_the_model_and_as_before_elsewhere():
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    counts = []

    def prepare(piece):
        counts.append(torch.get_num_threads())
        return _pixels(piece)

    ahead = PixelsAhead(prepare, Ahead(n_threads=2))
    try:
        frames = _frames(6)
        ahead.expect(frames)
        for frame in frames:
            ahead.take(frame)
        later = []
        thread = threading.Thread(target=lambda: later.append(torch.get_num_threads()))
        thread.start()
        thread.join()
        assert (set(counts), later, torch.get_num_threads()) == ({1}, [2], 2)
    finally:
        ahead.close()
        torch.set_num_threads(before)


def test_a_process_takes_its_share_of_threads(monkeypatch):
    for share, expected in ((1, 1), (4, 4), (64, 8)):
        monkeypatch.setattr(torch, "get_num_threads", lambda share=share: share)
        assert Ahead().threads == expected
        assert Ahead(n_threads=12).threads == 12
