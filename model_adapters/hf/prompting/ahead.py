"""Reading and scaling of frames in threads, ahead of the model.

Without it the model waits while frames are read: a GPU takes a few milliseconds for a frame, and so
does its image processor. Pillow, numpy and the compiled loops let other threads run meanwhile.
"""

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from threading import Barrier

import torch

from model_adapters.hf.family import Family, Pixels
from model_adapters.hf.prompting.hashing import hash_frame
from model_adapters.hf.prompting.prompt import Clip, Frame

_MOST_THREADS = 8  # more of them wait for Python's lock


@dataclass(frozen=True)
class Ahead:
    """How far frames are prepared ahead of the model.

    Attributes:
        n_threads: threads that prepare frames; 0 prepares each when the model asks for it. The
            share of processors that this process has where None.
        max_bytes: most bytes of prepared frames that wait for the model; one waits in any case.
            While a frame is being prepared it takes several times what it takes afterwards.
    """

    n_threads: int | None = None
    max_bytes: int = 2**28

    @property
    def threads(self) -> int:
        """Threads that prepare frames."""
        # Workers of one machine are given their shares of it as torch's threads.
        share = min(torch.get_num_threads(), _MOST_THREADS)
        return share if self.n_threads is None else self.n_threads


def read_pixels(family: Family, piece: Frame | Clip) -> Pixels:
    """Return what the family's image processor makes of a frame or a clip.

    All pixels that a model of a known family sees are made here.
    """
    if isinstance(piece, Frame):
        return family.prepare(piece.ref.load())
    assert family.video is not None  # it made the clip
    return family.video.prepare(piece.shape, [ref.load() for ref in piece.refs])


class PixelsAhead:
    """Pixels of the frames and clips of a prompt, in the order in which the model asks for them.

    For one thread, the model's. A frame that cannot be read raises its error when it is asked for,
    so only prompts that show it fail.

    Attributes:
        hashes: hash of the pixels of every frame and clip so far.
    """

    def __init__(self, prepare: Callable[[Frame | Clip], Pixels], ahead: Ahead) -> None:
        """Start no thread yet; `prepare` is called in several at the same time."""
        self.hashes: dict[Frame | Clip, str] = {}
        self._make = prepare
        self._n_threads = ahead.threads
        self._max_bytes = ahead.max_bytes
        self._threads: ThreadPoolExecutor | None = None
        self._coming: deque[Frame | Clip] = deque()
        self._begun: dict[Frame | Clip, Future[Pixels]] = {}
        self._largest = 0  # bytes of the largest one so far

    def expect(self, pieces: Sequence[Frame | Clip]) -> None:
        """Begin to prepare pieces that will be asked for, in this order; forget earlier ones."""
        self._forget()
        # One that is asked for at once gains nothing.
        if self._n_threads and len(pieces) > 1:
            self._coming.extend(dict.fromkeys(pieces))
            self._begin()

    def take(self, piece: Frame | Clip) -> Pixels:
        """Return the pixels of a piece, and no longer keep them; prepare them if needed."""
        begun = self._begun.pop(piece, None)
        if begun is None:
            if piece in self._coming:
                self._coming.remove(piece)
            return self._prepare(piece)
        pixels = begun.result()
        self._largest = max(self._largest, sum(value.nbytes for value in pixels.values()))
        self._begin()
        return pixels

    def close(self) -> None:
        """End the threads."""
        self._forget()
        if self._threads is not None:
            self._threads.shutdown()
            self._threads = None

    def _prepare(self, piece: Frame | Clip) -> Pixels:
        pixels = self._make(piece)
        self.hashes[piece] = hash_frame(pixels)
        return pixels

    def _forget(self) -> None:
        self._coming.clear()
        while self._begun:
            self._begun.popitem()[1].cancel()

    def _begin(self) -> None:
        """Begin to prepare what memory allows."""
        if self._threads is None:
            self._threads = _start_threads(self._n_threads)
        while self._coming and self._has_room():
            piece = self._coming.popleft()
            self._begun[piece] = self._threads.submit(self._prepare, piece)

    def _has_room(self) -> bool:
        n_begun = len(self._begun)
        if not self._largest:  # nobody knows yet how large they are
            return n_begun < self._n_threads
        return not n_begun or (n_begun + 1) * self._largest <= self._max_bytes


def _start_threads(n_threads: int) -> ThreadPoolExecutor:
    """Start threads whose torch computes in one thread each: they share the processors already."""
    before = torch.get_num_threads()
    started = Barrier(n_threads + 1)

    def begin() -> None:
        torch.get_num_threads()  # sets the thread's number, which it would do later otherwise
        torch.set_num_threads(1)
        started.wait()

    threads = ThreadPoolExecutor(n_threads, "frames", initializer=begin)
    for _ in range(n_threads):  # each waits in `begin`, so each takes a thread of its own
        threads.submit(int)
    started.wait()
    torch.set_num_threads(before)  # for threads that others start later
    return threads
