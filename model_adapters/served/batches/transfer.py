"""What every dialect asks a server of batches for: values of a type, and whole files by lines."""

from collections.abc import Callable, Iterator
from typing import Annotated, TypeVar

import msgspec

from infthor_eval.errors import ModelError
from model_adapters.served.batches.service import Batch, BatchReply
from model_adapters.served.completion import decode_reply
from model_adapters.served.endpoint import Endpoint
from model_adapters.served.wire import Answer, Call

__all__ = ["LARGEST", "TRANSFER_S", "ServerId", "Transfer"]

# A server's name of a batch or a file, which becomes a part of addresses.
ServerId = Annotated[str, msgspec.Meta(pattern=r"\A[\w./:@=+~-]{1,300}\Z")]

LARGEST = 2**30  # bytes of the largest accepted list, or file of replies
TRANSFER_S = 3600.0  # limit for sending or fetching a whole file, in seconds

_MOST_PAGES = 1000

T = TypeVar("T")


class _Named(msgspec.Struct, frozen=True):
    custom_id: str = ""
    key: str = ""  # Google's name of the same


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

    def replies(
        self, batch: Batch, path: str, kind: type[T], read: Callable[[str, T], BatchReply]
    ) -> Iterator[BatchReply]:
        """Yield the replies of a batch in a file; `read` makes one of a request and its line.

        A line that is damaged is the fault of its request alone. The file is refused if it has
        damaged lines, and none that names a request.
        """
        fault, n_named = None, 0
        call = Call(method="GET", path=path, largest=LARGEST, timeout_s=TRANSFER_S)
        for content in self.send(call).content.splitlines():
            request = None
            try:
                legible = content.decode(errors="replace").encode()
                named = decode_reply(self.where, legible, _Named, "the lines of a batch")
                n_named += 1
                request = batch.request_of(named.custom_id or named.key)
                if request is not None:
                    yield read(request, decode_reply("it", content, kind, "a line of a batch"))
            except ModelError as error:
                fault = error
                if request is not None:
                    yield BatchReply(request, 0, str(error))
        if fault is not None and not n_named:
            raise fault

    def pages(self, path: str, kind: type[T], after: Callable[[T], str]) -> Iterator[T]:
        """Yield the pages of the server's list of batches; `after` returns what the address of the
        next one has more, empty for none.

        Raises:
            ModelError: the list has no end.
        """
        seen: list[str] = []
        more = ""
        while more not in seen and len(seen) < _MOST_PAGES:
            seen.append(more)
            call = Call(method="GET", path=f"{path}{more}", largest=LARGEST)
            page = self.read(call, kind, "a list of batches")
            yield page
            more = after(page)
            if not more:
                return
        raise ModelError(f"{self.where} lists its batches without end; leave out batch")
