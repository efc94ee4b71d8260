"""What every dialect asks a server of batches for: values of a type, and whole files by lines."""

import re
from collections.abc import Callable, Iterator
from typing import Annotated, TypeVar

import msgspec

from infthor_eval.errors import ModelError
from model_adapters.served.batches.service import Batch, BatchReply
from model_adapters.served.completion import decode_reply
from model_adapters.served.endpoint import Endpoint
from model_adapters.served.wire import Answer, Call

# A server's name of a batch or a file, which becomes a part of addresses.
ServerId = Annotated[str, msgspec.Meta(pattern=r"\A[\w./:@=+~-]{1,300}\Z")]

LARGEST = 2**30  # bytes of the largest accepted list, or file of replies
TRANSFER_S = 3600.0  # limit for sending or fetching a whole file, in seconds

_MOST_PAGES = 1000
# Names of requests (Google's field is another one), also in a line that is no JSON.
_NAMES = re.compile(rb'"(?:custom_id|key)":\s*"([\w-]+)"')

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

    def submit(self, call: Call, kind: type[T], find: Callable[[], str | None]) -> T | str:
        """Return the batch that a call makes, or its name if it was lost, and make it once.

        The reply to an attempt may be lost, though the server has the batch: before each further
        attempt `find` looks for it there.
        """
        done = self._endpoint.ask_unless_done(call, find)[0]
        if isinstance(done, str):
            return done
        return decode_reply(self.where, done.content, kind, "a batch")

    def replies(
        self, batch: Batch, path: str, kind: type[T], read: Callable[[str, T], BatchReply]
    ) -> Iterator[BatchReply]:
        """Yield the replies of a batch in a file; `read` makes one of a request and its line.

        A line that is damaged is the fault of its request alone.
        """
        call = Call(method="GET", path=path, largest=LARGEST, timeout_s=TRANSFER_S)
        lines = self.send(call).content.splitlines()
        names = [_NAMES.findall(content) for content in lines]
        if lines and not any(names):
            raise ModelError(f"{self.where} answers without a line of a batch; see its log")
        for content, named in zip(lines, names, strict=True):
            request = next(filter(None, (batch.request_of(name.decode()) for name in named)), None)
            if request is None:
                continue
            try:
                yield read(request, decode_reply("it", content, kind, "a line of a batch"))
            except ModelError as error:
                yield BatchReply(request, 0, str(error))

    def pages(self, path: str, kind: type[T], after: Callable[[T], str]) -> Iterator[T]:
        """Yield the pages of the server's list of batches; `after` returns what the address of the
        next one has more, empty for none.
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
