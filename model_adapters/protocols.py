"""What a model is to the harness.

A conversation is an append-only list of turns with marks. Whoever evaluates appends what the model is to see, asks for
a reply, and rewinds to a mark; how a back end avoids encoding the same parts twice is its own business. A policy is
simpler: a frame and an instruction in, a chunk of arm movements out.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, Literal, Protocol, runtime_checkable

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef

__all__ = [
    "ROLES",
    "Adapter",
    "ArmDelta",
    "Capabilities",
    "Conversation",
    "Decoding",
    "Mark",
    "Model",
    "Part",
    "Policy",
    "Reply",
    "Role",
    "Subject",
    "Turn",
]

Part = str | FrameRef
Role = Literal["system", "user", "assistant"]
ROLES: tuple[Role, ...] = ("system", "user", "assistant")


@dataclass(frozen=True)
class Turn:
    """What one side of a conversation says at a time.

    Attributes:
        role: who speaks.
        parts: texts and frames; texts that touch are joined to one, empty ones left out.
    """

    role: Role
    parts: tuple[Part, ...]


@dataclass(frozen=True, kw_only=True)
class Decoding:
    """How a reply is decoded.

    Attributes:
        max_new_tokens: limit of the reply, at least 1.
        temperature: 0 decodes greedily; above it tokens are drawn.
        top_p: draw from the most likely tokens that together have this probability; of no account when greedy.
        seed: of the draws; the same request with the same seed is answered the same way.
        stop: strings that end the reply; the first to appear is cut off with what follows.
        choices: where there are any, the reply is one of these texts, whole: no stop string cuts it.
    """

    max_new_tokens: int
    temperature: float = 0.0
    top_p: float = 1.0
    seed: int = 0
    stop: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse values that mean nothing.

        Raises:
            UsageError: names the value.
        """
        if self.max_new_tokens < 1:
            raise UsageError(f"max_new_tokens must be at least 1, not {self.max_new_tokens}")
        if not 0 <= self.temperature < float("inf"):
            raise UsageError(f"temperature must be 0 (greedy) or above, not {self.temperature}")
        if not 0 < self.top_p <= 1:
            raise UsageError(f"top_p must be above 0 and at most 1, not {self.top_p}")
        if "" in self.stop or "" in self.choices:
            raise UsageError("an empty text can neither stop a reply nor be one of its choices; leave it out")

    @property
    def greedy(self) -> bool:
        """Whether nothing is drawn."""
        return self.temperature == 0

    def document(self) -> dict[str, Any]:
        """All of it as JSON values, for fingerprints."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}


@dataclass(frozen=True)
class Reply:
    """What a model answered.

    Attributes:
        text: the reply without end-of-turn tokens, cut before the first stop string.
        n_reply_tokens: length of the reply in tokens; None where the model does not tell.
        n_context_tokens: tokens of the whole context that the reply was made from, frames expanded; None likewise.
        n_cached_tokens: how many of them were not encoded again; None likewise.
        token_ids: the generated ids without the end-of-turn token; where a stop string ended the reply, up to the
            token that completed it; None where the model does not tell.
        faults: what went wrong and was survived on the way (a request sent again, say), a line each.
        cost: what it cost, in US dollars; None where nothing is paid, or no price is known.
    """

    text: str
    n_reply_tokens: int | None = None
    n_context_tokens: int | None = None
    n_cached_tokens: int | None = None
    token_ids: tuple[int, ...] | None = None
    faults: tuple[str, ...] = ()
    cost: float | None = None


@dataclass(frozen=True, kw_only=True)
class Capabilities:
    """What a model can do and how it wants to be asked; `check_adapter` holds it to this, and to no more.

    Attributes:
        counts_tokens: `n_tokens` and `tokens_per_frame` are exact; None is given for both where not.
        token_ids: replies have their ids.
        deterministic: the same request is answered the same way, greedily or with the same seed.
        sampling: a temperature above 0 is taken.
        choices: a reply can be held to some texts.
        batch_size: how many continuations of a conversation are worth handing over at once.
        max_in_flight: how many conversations may be asked at the same time, from as many threads.
        max_tokens: limit of context and reply together, in tokens; None where there is none, or none is known.
        max_tokens_before_extension: the checkpoint's own limit where `max_tokens` extends it, else None.
    """

    counts_tokens: bool = True
    token_ids: bool = True
    deterministic: bool = True
    sampling: bool = False
    choices: bool = False
    batch_size: int = 1
    max_in_flight: int = 1
    max_tokens: int | None = None
    max_tokens_before_extension: int | None = None


@dataclass(frozen=True, eq=False)
class Mark:
    """A point of one conversation, handed out by `Conversation.mark` and compared by identity.

    Attributes:
        n_parts: how many parts the conversation had.
    """

    n_parts: int


@runtime_checkable
class Conversation(Protocol):
    """What a model has seen so far, as turns of texts and frames."""

    @property
    def n_tokens(self) -> int | None:
        """Tokens that `reply` would give the model now, chat template included; None where it counts none.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the model cannot take the turns as they stand.
        """
        ...

    def append(self, *parts: Part, role: Role = "user") -> None:
        """Add parts at the end, to the last turn where the role is the same, else as a turn of their own.

        Texts of a turn that touch are read as one text, without anything between them.

        Raises:
            TypeError: a part is neither text nor a frame reference.
            ValueError: there is no such role.
        """
        ...

    def mark(self) -> Mark:
        """The present end, to come back to."""
        ...

    def rewind(self, mark: Mark) -> None:
        """Forget all that was appended after the mark; marks set after it die, the mark itself stays good.

        Raises:
            ValueError: the mark is another conversation's, or lies after a point that was rewound to.
        """
        ...

    def reply(self, decoding: Decoding) -> Reply:
        """The assistant's next turn; the conversation stays as it was (append the text if it is to be remembered).

        Raises:
            ModelError: the context does not fit (the message gives its tokens and the limit), memory ran out, or the
                model has no such turns or no such decoding.
            DataError: a frame cannot be read.
        """
        ...

    def replies(self, continuations: Sequence[Sequence[Part]], decoding: Decoding) -> list[Reply]:
        """What append (as user), reply, rewind would give for each continuation; the conversation stays as it was.

        Args:
            continuations: the parts to append, one sequence per reply.
            decoding: for each.

        Raises:
            ModelError: as `reply`; nothing is answered then.
            DataError: as `reply`; nothing is answered then.
        """
        ...


class Subject(Protocol):
    """What can be evaluated: a model, a policy, or a suite's own baseline."""

    @property
    def name(self) -> str:
        """Its name on the command line."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """What it can do; to a policy only `deterministic` and `max_in_flight` matter."""
        ...

    def identity(self) -> dict[str, Any]:
        """All that can change a number, as JSON values; two subjects of equal identity answer or act alike."""
        ...

    def close(self) -> None:
        """Give the memory back; it cannot be used afterwards."""
        ...


@runtime_checkable
class Model(Subject, Protocol):
    """A model that can be talked to."""

    def tokens_per_frame(self, frame: FrameRef) -> int | None:
        """How many of the model's tokens one frame becomes, its surroundings in the chat template not counted.

        Raises:
            DataError: the frame cannot be read.
        """
        ...

    def conversation(self) -> Conversation:
        """A new, empty conversation."""
        ...


@dataclass(frozen=True)
class ArmDelta:
    """One step of a robot arm's end effector, in the frame of the robot's base.

    The base's x points forward, y left, z up (right-handed); docs/policies.md says how models' numbers come to be
    these.

    Attributes:
        translation: by how much it moves along x, y, z, in metres.
        rotation: by how much it turns about x, y, z (roll, pitch, yaw), in radians.
        gripper: where the gripper is to be, not by how much it moves: 0 (closed) to 1 (open).
    """

    translation: tuple[float, float, float]
    rotation: tuple[float, float, float]
    gripper: float


@runtime_checkable
class Policy(Subject, Protocol):
    """A vision-language-action model that drives an arm."""

    def reset(self) -> None:
        """Begin a new episode: whatever was remembered of the last one is forgotten."""
        ...

    def act(self, frame: FrameRef, instruction: str) -> tuple[ArmDelta, ...]:
        """The next steps, at least one, to be carried out in order.

        Args:
            frame: the agent's present view.
            instruction: what is to be done, in words ("pick up the mug").

        Raises:
            ModelError: the policy cannot act, or memory ran out.
            DataError: the frame cannot be read.
        """
        ...


class Adapter(Protocol):
    """What a registered "module:Class" must be: options as a dataclass with defaults, and a way to build."""

    Options: ClassVar[type]

    @classmethod
    def build(cls, name: str, options: Any, seed: int) -> Model | Policy:
        """Make the model or the policy.

        Args:
            name: the name it was asked for.
            options: an instance of `Options`.
            seed: for whatever is random in it.
        """
        ...
