"""A policy behind a server of websockets: a session for each thread that acts."""

import importlib
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from threading import get_ident
from typing import Any, ClassVar, Self
from urllib.parse import urlsplit

from infthor_eval.errors import ModelError, in_one_line, wrap_errors
from model_adapters.addresses import is_local
from model_adapters.options.policies import SocketPolicyOptions
from model_adapters.protocols import ArmDelta, ArmObservation, Capabilities, Episode
from model_adapters.remote_policies.actions import Convention

# What msgpack and numpy raise on damaged messages.
DAMAGED = (ValueError, TypeError, KeyError, OverflowError, SyntaxError)
_LARGEST = 16 * 2**20  # bytes of the largest accepted message
_FIRST_WAIT_S = 0.5  # pause before the second attempt; it doubles before each further one
_CLOSE_S = 1.0  # that a server is waited for when a connection is closed
_OF_NO_ACTION = {"timeout_s", "retries", "deterministic", "max_in_flight"}


def import_extra(name: str, module: str) -> Any:
    """Return a module that the adapter of this name needs (ModelError)."""
    hint = "pip install 'infthor-eval[vla]'"
    with wrap_errors(f"{name} lacks a package", hint, catch=ImportError, raise_as=ModelError):
        return importlib.import_module(module)


class Session:
    """A connection of one thread to a server; base of one class for each protocol.

    Everything raises `ModelError` where the server does not answer in time or as it should.

    Attributes:
        server: what messages call it.
        episode: the one that goes on.
        convention: how its actions are read.
        greeting: what it says of itself, as JSON values.
    """

    convention: Convention
    greeting: Any

    def __init__(self, name: str, options: SocketPolicyOptions) -> None:
        self.server = f"{name} ({options.url})"
        self.episode: Episode | None = None
        self._options = options
        self._connect = import_extra(name, "websockets.sync.client").connect
        self._errors = import_extra(name, "websockets.exceptions").WebSocketException
        with ExitStack() as stack:
            self._socket = stack.enter_context(self._connected())
            self._socket.socket.settimeout(options.timeout_s)  # of what is sent
            self._deadline = time.monotonic() + options.timeout_s
            self._greet()
            self._stack = stack.pop_all()

    @property
    def is_open(self) -> bool:
        """Whether neither side has ended it."""
        return bool(self._socket.state.name == "OPEN")

    def begin(self, episode: Episode) -> None:
        """Begin an episode, and tell the server if its protocol has episodes."""
        self.episode = episode

    def act(self, observation: ArmObservation) -> tuple[ArmDelta, ...]:
        """Return the server's next steps."""
        assert self.episode is not None
        answer = self._ask(observation, self.episode.instruction)
        if "actions" not in answer:
            given = ", ".join(map(str, answer)) or "nothing"
            raise ModelError(f"{self.server} answers without actions ({given}); see its log")
        return self.convention.deltas(self.server, answer["actions"])

    def end(self, *, success: bool | None) -> None:
        """End the episode, and tell the server likewise."""
        self.episode = None

    def close(self) -> None:
        """End the session."""
        self._stack.close()

    def _greet(self) -> None:
        """Set `greeting` and `convention`."""
        raise NotImplementedError

    def _ask(self, observation: ArmObservation, instruction: str) -> dict[Any, Any]:
        """Return the server's answer to an observation."""
        raise NotImplementedError

    def _unpack(self, content: bytes) -> Any:
        """Return what is in a message; a damaged one raises one of `DAMAGED`."""
        raise NotImplementedError

    def _send(self, content: bytes) -> None:
        self._deadline = time.monotonic() + self._options.timeout_s
        with self._in_one_line():
            self._socket.send(content)

    def _receive(self) -> Any:
        """Return the next message; it is late `timeout_s` after the last one that was sent."""
        with self._in_one_line():
            content = self._socket.recv(timeout=max(0.0, self._deadline - time.monotonic()))
        if isinstance(content, str):  # of openpi, a traceback
            line = content.strip().rpartition("\n")[2]
            raise ModelError(f"{self.server} answers with the text {line!r}; see its log")
        problem = f"{self.server} sends no message of its protocol"
        with wrap_errors(problem, "is it another server?", catch=DAMAGED, raise_as=ModelError):
            return self._unpack(content)

    def _connected(self) -> Any:
        options = self._options
        reason = OSError()
        for attempt in range(options.retries + 1):
            if attempt:
                time.sleep(_FIRST_WAIT_S * 2 ** (attempt - 1))
            try:
                with self._in_one_line(OSError):
                    return self._connect(
                        options.url,
                        compression=None,
                        proxy=None if is_local(urlsplit(options.url)) else True,
                        open_timeout=options.timeout_s,
                        ping_interval=None,  # some servers answer none while they compute
                        close_timeout=_CLOSE_S,
                        max_size=_LARGEST,
                    )
            except OSError as error:
                reason = error
        raise ModelError(
            f"{self.server} cannot be reached in {options.retries + 1} attempts "
            f"({in_one_line(reason)}); is the server up?"
        )

    @contextmanager
    def _in_one_line(self, *passing: type[Exception]) -> Iterator[None]:
        try:
            yield
        except passing:
            raise
        except (TimeoutError, self._errors, ImportError) as error:
            # ImportError: of a SOCKS proxy's package. A cause: of what cannot be sent.
            if isinstance(error, TimeoutError) or isinstance(error.__cause__, TimeoutError):
                late = f"{self.server} does not answer within {self._options.timeout_s:g} s"
                raise ModelError(f"{late}; raise timeout_s if it is slow") from error
            ended = f"{self.server} ends the connection ({in_one_line(error)})"
            raise ModelError(f"{ended}; see its log") from error


class RemotePolicy:
    """A policy behind a server; see `Policy`.

    A failure ends the thread's session, and the next episode begins a new one: what a server still
    sends is not read, and no episode goes on in a session that does not know its beginning. What a
    server says of itself must stay the same, as actions are read by it.

    Subclasses are the adapters.

    Attributes:
        session: class of the sessions.
    """

    Options: ClassVar[type] = SocketPolicyOptions
    session: ClassVar[type[Session]]

    def __init__(self, name: str, options: SocketPolicyOptions) -> None:
        self.name = name
        self._options = options
        first = self.session(name, options)
        self._sessions = {get_ident(): first}  # by their threads
        self._said = {"server": first.greeting, "actions": asdict(first.convention)}

    @classmethod
    def build(cls, name: str, options: SocketPolicyOptions, seed: int) -> Self:  # noqa: ARG003
        """Connect, so that a server that does not fit ends a run before it begins (ModelError)."""
        return cls(name, options)

    @property
    def capabilities(self) -> Capabilities:
        """As the user says of the server."""
        return Capabilities(
            counts_tokens=False,
            token_ids=False,
            deterministic=self._options.deterministic,
            max_in_flight=self._options.max_in_flight,
        )

    def identity(self) -> dict[str, Any]:
        """Return options, what the server says of itself, and how actions are read, as JSON."""
        options = asdict(self._options).items()
        settings = {name: value for name, value in options if name not in _OF_NO_ACTION}
        return {"adapter": self.name} | settings | self._said

    def begin(self, episode: Episode) -> None:
        """See `Policy`; connects again where the connection is lost (ModelError)."""
        session = self._sessions.get(get_ident())
        if session is None or not session.is_open:
            self._drop()
            session = self._sessions[get_ident()] = self.session(self.name, self._options)
        with self._dropping():
            if session.greeting != self._said["server"]:
                hint = "begin a new run"
                raise ModelError(f"{session.server} says that it is another policy now; {hint}")
            session.begin(episode)

    def act(self, observation: ArmObservation) -> tuple[ArmDelta, ...]:
        """See `Policy`."""
        with self._dropping():
            return self._begun().act(observation)[: self._options.execute]

    def end(self, *, success: bool | None) -> None:
        """See `Policy`; raises `ModelError` where the server can no longer be told."""
        with self._dropping():
            self._begun().end(success=success)

    def close(self) -> None:
        """Close the connections of all threads."""
        while self._sessions:
            self._sessions.popitem()[1].close()

    def _begun(self) -> Session:
        session = self._sessions.get(get_ident())
        if session is None or session.episode is None:
            raise ModelError(f"{self.name}: no episode goes on; call begin() first")
        return session

    @contextmanager
    def _dropping(self) -> Iterator[None]:
        try:
            yield
        except ModelError:
            self._drop()
            raise

    def _drop(self) -> None:
        session = self._sessions.pop(get_ident(), None)
        if session is not None:
            session.close()
