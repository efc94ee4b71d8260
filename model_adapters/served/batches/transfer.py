"""What every dialect asks a server of batches for: values of a type, and whole files by lines."""

from collections.abc import Callable, Iterator
from typing import TypeVar

from model_adapters.served.completion import decode_reply
from model_adapters.served.endpoint import Endpoint
from model_adapters.served.wire import Answer, Call

__all__ = ["LARGEST", "TRANSFER_S", "Transfer"]

LARGEST = 2**30  # bytes of the largest accepted list, or file of replies
TRANSFER_S = 3600.0  # limit for sending or fetching a whole file, in seconds

T = TypeVar("T")


class Transfer:
    """A server's replies about batches, parsed strictly.

    All of it raises `NoAnswerError` where all attempts fail, and `ModelError` where the server
    refuses or answers with something else.
    """

    def __init__(self, endpoint: Endpoint) -> None:
        self.where = endpoint.where
        self._endpoint = endpoint

    def send(self, call: Call) -> Answer:
        """Return the server's reply as it is."""
        return self._endpoint.ask(call)[0]

    def read(self, call: Call, kind: type[T], what: str) -> T:
        """Return what the server answers, of a type; `what` names it in messages."""
        return decode_reply(self.where, self.send(call).content, kind, what)

    def submit(self, call: Call, kind: type[T], find: Callable[[], T | None]) -> T:
        """Return the batch that a call makes, and make it once.

        The reply to an attempt may be lost, though the server has the batch: before each further
        attempt `find` looks for it there.
        """
        done = self._endpoint.ask_unless_done(call, find)[0]
        if isinstance(done, Answer):
            return decode_reply(self.where, done.content, kind, "a batch")
        return done

    def lines(self, path: str, kind: type[T]) -> Iterator[T]:
        """Yield the lines of a file of replies."""
        call = Call(method="GET", path=path, largest=LARGEST, timeout_s=TRANSFER_S)
        for content in self.send(call).content.splitlines():
            yield decode_reply(self.where, content, kind, "the lines of a batch")

    def page(self, path: str, kind: type[T]) -> T:
        """Return a page of the server's list of batches."""
        call = Call(method="GET", path=path, largest=LARGEST)
        return self.read(call, kind, "a list of batches")
