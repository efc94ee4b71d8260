"""A person as a `Model`."""

import sys
from collections.abc import Sequence
from contextlib import ExitStack
from socket import socket
from typing import Any

from model_adapters.backend import UncountedBackend
from model_adapters.human.adapter import HumanOptions
from model_adapters.human.desk import Desk, Inquiry
from model_adapters.human.serving import serve_desk
from model_adapters.protocols import Capabilities, Decoding, Notice, Reply, Turn
from model_adapters.thinking import cut_at_stop

UNTIMED = (
    "the page never reported that the question was on the screen: its seconds count from when it "
    "was asked"
)


class HumanModel(UncountedBackend):
    """A person, who answers on a page of this machine; the page opens with the first request."""

    def __init__(self, name: str, options: HumanOptions, listening: socket) -> None:
        self.name = name
        self._options = options
        self._desk = Desk()
        self._notice = Notice()
        self._position: tuple[int, int] | None = None
        self._listening = listening
        self._page = ExitStack()
        self._page.enter_context(listening)
        self._is_open = False

    @property
    def capabilities(self) -> Capabilities:
        """One question at a time; nothing is counted in tokens, and nobody answers the same twice
        for certain."""
        return Capabilities(
            counts_tokens=False, token_ids=False, deterministic=False, sampling=True, choices=True
        )

    def identity(self) -> dict[str, Any]:
        """Return who answers, as JSON values."""
        return {"adapter": self.name, "reader": str(self._options.reader)}

    def show_notice(self, notice: Notice) -> None:
        """See `PersonModel`."""
        self._notice = notice

    def show_position(self, number: int, n_units: int) -> None:
        """See `PersonModel`."""
        self._position = number, n_units

    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """Show what a model would be given, and wait for the answer; see `Conversation.reply`."""
        self._open()
        answer = self._desk.ask(Inquiry(tuple(turns), decoding, self._notice, self._position))
        before_stop = None if decoding.choices else cut_at_stop(answer.text, decoding.stop)
        return Reply(
            answer.text if before_stop is None else before_stop,
            n_watched=answer.n_watched,
            seconds=answer.seconds,
            faults=() if answer.seconds is not None else (UNTIMED,),
        )

    def close(self) -> None:
        """Tell the page that it is over, and close it."""
        # An error that ends the run may have come before the last answer was on disk.
        self._desk.close(is_kept=sys.exc_info()[0] is None)
        self._page.close()

    def _open(self) -> None:
        if not self._is_open:
            self._page.enter_context(serve_desk(self._desk, self._options, self._listening))
            self._is_open = True
