"""The protocol between a model behind a server and the dialect that the server speaks.

To add a dialect: a folder here, as `openai`; its options in `options.py`, its adapter in
`adapters.py`, its line in `model_adapters/built_in.py`.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from model_adapters.protocols import Decoding, Turn
from model_adapters.served.batches.service import BatchService
from model_adapters.served.completion import Completion
from model_adapters.served.endpoint import Endpoint


class Dialect(Protocol):
    """How requests to a server and its replies are written.

    Attributes:
        path: path of requests, below the server's address.
        hint: how to fix a request that is refused.
        guides: true if replies can be restricted to choices.
    """

    path: str
    hint: str
    guides: bool

    def headers(self, key: str | None) -> Mapping[str, str]:
        """Return the headers of every request; `key` is the API key, if there is one."""

    def request(self, turns: Sequence[Turn], decoding: Decoding) -> dict[str, Any]:
        """Return a request as JSON values.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the server does not take these turns.
        """

    def read(self, where: str, content: bytes) -> Completion:
        """Parse the reply of the server that `where` names.

        Raises:
            ModelError: it is no reply of this dialect.
        """

    def batch_service(self, endpoint: Endpoint) -> BatchService:
        """Return the part of the server that takes batches."""
