"""Protocols of models and policies.

A conversation is an append-only list of turns with marks. The harness appends what the model is to
see, requests a reply, and rewinds to a mark; each back end decides how it avoids encoding the same
parts twice. A policy is simpler: it maps a frame and an instruction to a chunk of arm movements.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal, Protocol, runtime_checkable

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video

Part = str | FrameRef | Video
Role = Literal["system", "user", "assistant"]
ROLES: tuple[Role, ...] = ("system", "user", "assistant")


@dataclass(frozen=True)
class Turn:
    """One turn of a conversation.

    Attributes:
        role: speaker of the turn.
        parts: texts, frames and videos in order; adjacent texts are joined, empty texts dropped.
    """

    role: Role
    parts: tuple[Part, ...]


@dataclass(frozen=True, kw_only=True)
class CacheCut:
    """What is kept of keys and values of the frames before the last one, when these are encoded.

    Attributes:
        method: class that chooses or makes what is kept, MODULE:CLASS (`hf.kept.methods`).
        budget: most tokens that are kept of these frames; None for all.
        frames: numbers of the frames, in the conversation, that are kept; None if the method
            chooses tokens.
        clues: numbers of those with evidence, of which the reply says how much was kept; no method
            is told them.
    """

    method: str
    budget: int | None = None
    frames: tuple[int, ...] | None = None
    clues: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Decoding:
    """Settings of decoding a reply.

    Attributes:
        max_new_tokens: most tokens of the reply, at least 1.
        temperature: sampling temperature; 0 decodes greedily.
        top_p: probability mass of the most likely tokens that are sampled from; ignored when
            greedy.
        seed: seed of the samples; the same request with the same seed gets the same reply.
        stop: strings that end the reply; the reply is cut before the first to appear.
        choices: allowed replies; if there are any, the reply is one of them, and no stop string
            cuts it.
        repetition_penalty: penalty of tokens in context and reply, as in transformers, 1 for none;
            None for the checkpoint's own (1.05 in Qwen2.5-VL).
        cache: what the model keeps of frames in its cache; None for everything.
    """

    max_new_tokens: int
    temperature: float = 0.0
    top_p: float = 1.0
    seed: int = 0
    stop: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    repetition_penalty: float | None = None
    cache: CacheCut | None = None

    def __post_init__(self) -> None:
        """Check the ranges of all values; raise `UsageError` for one that is out of its range."""
        if self.max_new_tokens < 1:
            raise UsageError(f"max_new_tokens must be at least 1, not {self.max_new_tokens}")
        if not 0 <= self.temperature < float("inf"):
            raise UsageError(f"temperature must be 0 (greedy) or above, not {self.temperature}")
        if not 0 < self.top_p <= 1:
            raise UsageError(f"top_p must be above 0 and at most 1, not {self.top_p}")
        if self.repetition_penalty is not None and not 0 < self.repetition_penalty < float("inf"):
            raise UsageError(f"repetition_penalty must be above 0, not {self.repetition_penalty}")
        if "" in self.stop or "" in self.choices:
            raise UsageError(
                "an empty text can neither stop a reply nor be one of its choices; leave it out"
            )

    @property
    def greedy(self) -> bool:
        """True if decoding is greedy."""
        return self.temperature == 0

    def document(self) -> dict[str, Any]:
        """Return all settings as JSON values, for fingerprints; a penalty that is the checkpoint's
        own is left out."""
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in asdict(self).items()
            if value is not None
        }


@dataclass(frozen=True)
class KeptCache:
    """What was kept of the cache of the frames before the last one.

    Attributes:
        tokens: tokens of a head, on average.
        bytes: bytes of all layers.
        clues: share of the clue frames' tokens that was kept, the mean of all heads; None if there
            are none.
    """

    tokens: float
    bytes: int
    clues: float | None


@dataclass(frozen=True)
class Reply:
    """A model's reply.

    Attributes:
        text: text of the reply without end-of-turn tokens, cut before the first stop string.
        n_reply_tokens: tokens of the reply, or None if the model does not report them.
        n_context_tokens: tokens of the context, frames expanded, or None if the model does not
            report them.
        n_cached_tokens: tokens of the context that were not encoded again, or None if the model
            does not report them.
        token_ids: generated ids without the end-of-turn token, or None if the model does not report
            them; after a stop string, all up to the token that completed it.
        faults: faults that were recovered from by a retry, a line each.
        cost: cost of the reply in US dollars, or None if it is free or its price unknown.
        thinking: what the model thought before the reply, if it is told apart from the text;
            thoughts between markers in the text are told from the answer where the reply is read
            (`model_adapters.thinking`).
        n_watched: different frames that a person looked at before replying; None for models.
        context_hash: hash of the ids of the context's tokens, frames expanded (hex); None if they
            are not known.
        frames_hash: hash of the pixels of the context's frames as the model read them (hex); None
            likewise.
        margins: how much likelier the likeliest token was than the second, at each token of the
            reply and the one that ends it, in nats; None unless the model was asked to say so.
        seconds: seconds that the reply took, where that is not the duration of the request: a
            person's, while the question was on the screen.
        kept: what was kept of the cache, if the decoding cuts it.
    """

    text: str
    n_reply_tokens: int | None = None
    n_context_tokens: int | None = None
    n_cached_tokens: int | None = None
    token_ids: tuple[int, ...] | None = None
    faults: tuple[str, ...] = ()
    cost: float | None = None
    thinking: str | None = None
    n_watched: int | None = None
    context_hash: str | None = None
    frames_hash: str | None = None
    margins: tuple[float, ...] | None = None
    seconds: float | None = None
    kept: KeptCache | None = None


@dataclass(frozen=True, kw_only=True)
class Capabilities:
    """What a model supports; `check_adapter` checks that all of it holds.

    Attributes:
        counts_tokens: `n_tokens` and `tokens_per_frame` are exact; if false, both are None.
        token_ids: replies have token ids.
        deterministic: the same request gets the same reply, greedily or with the same seed.
        sampling: temperatures above 0 are supported.
        choices: replies can be restricted to given texts.
        image_input: conversations take frames; if false, the model reads text alone, and a frame or
            a video is refused.
        video_input: conversations take videos; if false, a video is refused, and its frames can be
            given as images.
        cache_cuts: replies can be decoded behind a cut cache (`Decoding.cache`).
        batch_size: continuations of a conversation that the model answers together.
        batch_contexts: continuations that have no frames in common are worth answering together,
            too.
        max_in_flight: conversations that may be asked at the same time, each from its own thread.
        max_tokens: limit of context and reply together, in tokens, or None if there is none or it
            is unknown.
        max_tokens_before_extension: the checkpoint's own limit if `max_tokens` extends it, else
            None.
    """

    counts_tokens: bool = True
    token_ids: bool = True
    deterministic: bool = True
    sampling: bool = False
    choices: bool = False
    image_input: bool = True
    video_input: bool = False
    cache_cuts: bool = False
    batch_size: int = 1
    batch_contexts: bool = False
    max_in_flight: int = 1
    max_tokens: int | None = None
    max_tokens_before_extension: int | None = None


@dataclass(frozen=True, eq=False)
class Mark:
    """A point in one conversation, returned by `Conversation.mark` and compared by identity.

    Attributes:
        n_parts: parts in the conversation at this point.
    """

    n_parts: int


@runtime_checkable
class Conversation(Protocol):
    """The turns of texts, frames and videos that a model has seen so far."""

    @property
    def n_tokens(self) -> int | None:
        """Tokens that `reply` would give the model now, chat template included; None if it does not
        count them.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the model does not support these turns.
        """

    def append(self, *parts: Part, role: Role = "user") -> None:
        """Add parts at the end: to the last turn if it has the same role, else as a new turn.

        Adjacent texts of a turn are joined without a separator.

        Raises:
            TypeError: a part is neither text, frame reference nor video.
            ValueError: the role is unknown.
        """

    def mark(self) -> Mark:
        """Return a mark at the current end of the conversation."""

    def rewind(self, mark: Mark) -> None:
        """Drop everything that was appended after the mark; later marks become invalid, the mark
        itself stays valid.

        Raises:
            ValueError: the mark belongs to another conversation, or to a part that was dropped by a
                rewind.
        """

    def reply(self, decoding: Decoding) -> Reply:
        """Return the assistant's next turn without adding it to the conversation.

        Raises:
            ModelError: the context does not fit (the message has its tokens and the limit), memory
                ran out, or the model does not support these turns or this decoding.
            DataError: a frame cannot be read.
        """

    def replies(self, continuations: Sequence[Sequence[Part]], decoding: Decoding) -> list[Reply]:
        """Return the reply to each continuation, as append (as user), reply and rewind would;
        nothing is added.

        Args:
            continuations: the parts to append, one sequence per reply.
            decoding: decoding of every reply.

        Raises:
            ModelError: as `reply`; no reply is returned then.
            DataError: as `reply`; no reply is returned then.
        """


class Subject(Protocol):
    """Anything that can be evaluated: a model, a policy, or a suite's baseline."""

    @property
    def name(self) -> str:
        """Name on the command line."""

    @property
    def capabilities(self) -> Capabilities:
        """Capabilities; of a policy's only `deterministic` and `max_in_flight` are used."""

    def identity(self) -> dict[str, Any]:
        """Return all that can change a result, as JSON values; equal ones give equal results."""

    def close(self) -> None:
        """Free all memory; the subject cannot be used afterwards."""


@runtime_checkable
class Model(Subject, Protocol):
    """A model that answers in conversations."""

    def tokens_per_frame(self, frame: FrameRef) -> int | None:
        """Return the tokens of one frame, without its surroundings in the chat template; None if
        they are not counted.

        Raises:
            DataError: the frame cannot be read.
        """

    def conversation(self) -> Conversation:
        """Return a new, empty conversation."""


@dataclass(frozen=True)
class ArmDelta:
    """One step of a robot arm's end effector, in the frame of the robot's base: x forward, y left,
    z up (right-handed).

    docs/policies.md says how the outputs of policies are converted to this.

    Attributes:
        translation: movement along x, y, z, in metres.
        rotation: rotation about x, y, z (roll, pitch, yaw), in radians.
        gripper: target opening of the gripper (absolute, not a difference): 0 (closed) to 1 (open).
    """

    translation: tuple[float, float, float]
    rotation: tuple[float, float, float]
    gripper: float


@dataclass(frozen=True)
class Episode:
    """What a policy is told of an episode before its first view.

    Attributes:
        name: name of the episode in its run.
        instruction: the task in words ("pick up the mug").
        max_steps: most steps of the arm.
        history: frames of what happened before, in order, where the instruction is about that.
    """

    name: str
    instruction: str
    max_steps: int
    history: tuple[FrameRef, ...] = ()


@dataclass(frozen=True)
class HandState:
    """An arm's hand in the frame of the robot's base: x forward, y left, z up (right-handed).

    Attributes:
        position: of the wrist, metres.
        rotation: about x, y and z in this order, about axes that stay (roll, pitch, yaw), radians.
        gripper: 0 if the hand holds something, else 1 (open).
    """

    position: tuple[float, float, float]
    rotation: tuple[float, float, float]
    gripper: float


@dataclass(frozen=True)
class ArmObservation:
    """What a policy sees and feels before its next steps.

    Attributes:
        image: the agent's view.
        wrist: the view from its wrist; None where it was not asked for.
        state: its hand; None where it was not asked for.
        step: steps of the arm since the episode began.
    """

    image: FrameRef
    wrist: FrameRef | None = None
    state: HandState | None = None
    step: int = 0


@runtime_checkable
class Policy(Subject, Protocol):
    """A vision-language-action model that drives an arm.

    Episodes follow each other; those of a thread that acts at the same time are another's.
    """

    def begin(self, episode: Episode) -> None:
        """Begin an episode: all state of the last one is dropped, also if it was not ended."""

    def act(self, observation: ArmObservation) -> tuple[ArmDelta, ...]:
        """Return the next steps of the arm, at least one, in order.

        Raises:
            ModelError: the policy cannot act, or memory ran out.
            DataError: a frame cannot be read.
        """

    def end(self, *, success: bool | None) -> None:
        """End the episode; not called where the policy failed.

        Args:
            success: whether it succeeded; None where that would tell a later episode what it is to
                remember.
        """


@runtime_checkable
class FramePolicy(Subject, Protocol):
    """A policy that needs a frame and the instruction alone."""

    def reset(self) -> None:
        """Start a new episode: drop all state of the last one."""

    def act(self, frame: FrameRef, instruction: str) -> tuple[ArmDelta, ...]:
        """Return the next steps of the arm, at least one, in order.

        Args:
            frame: the agent's current view.
            instruction: the task in words ("pick up the mug").

        Raises:
            ModelError: the policy cannot act, or memory ran out.
            DataError: the frame cannot be read.
        """


class Adapter(Protocol):
    """An adapter class: its options, a dataclass with defaults, and how the model is built."""

    Options: ClassVar[type]

    @classmethod
    def build(cls, name: str, options: Any, seed: int) -> Model | Policy | FramePolicy:
        """Build the model or the policy.

        Args:
            name: name of the model as the user gave it.
            options: an instance of `Options`.
            seed: seed of whatever is random in the model.
        """


@dataclass(frozen=True, kw_only=True)
class Notice:
    """What a person is shown beside the conversation, and models are not.

    Attributes:
        title: heading of what is asked.
        unit: what a unit of the run is called ("question").
        facts: names and values, in order.
        news: what became of the last reply; empty if there is nothing to say.
        words: words that complete what is typed.
        replies: replies that are possible now, as buttons; others are possible too, unless the
            decoding has choices.
    """

    title: str = ""
    unit: str = ""
    facts: tuple[tuple[str, str], ...] = ()
    news: str = ""
    words: tuple[str, ...] = ()
    replies: tuple[str, ...] = ()


@runtime_checkable
class PersonModel(Model, Protocol):
    """A person who answers on a page in place of a model."""

    def show_notice(self, notice: Notice) -> None:
        """Show this with each request until the next notice."""

    def show_position(self, number: int, n_units: int) -> None:
        """Show which unit of the run comes next, from 1, and how many there are.

        Called only if one person answers the whole run, and so may stop it.
        """


class Batches(Protocol):
    """The requests of a run that a server answers together, hours later."""

    def collecting(self) -> AbstractContextManager[None]:
        """Within this context `Conversation.replies` records its requests and raises
        `NotAskedError`; after `fetch` it returns their replies."""

    def fetch(self) -> bool:
        """Have the collected requests answered; return whether some were not processed, so that
        they must be collected again.

        Raises:
            ModelError: the server cannot be asked.
            DataError: a file cannot be read or written.
        """


@runtime_checkable
class BatchModel(Model, Protocol):
    """A model whose server can answer many requests together, as a batch.

    Each request is sent at once until `open_batches` is called.
    """

    @property
    def uses_batches(self) -> bool:
        """True if the user asked for batches."""

    def open_batches(
        self, folder: Path, notify: Callable[[str], None], should_stop: Callable[[], bool]
    ) -> Batches:
        """Return the batches of a run; from then on all replies come from them.

        Args:
            folder: where the batches are kept, so that a later command finds them.
            notify: called with a line when a batch begins or ends.
            should_stop: returns True to stop waiting.

        Raises:
            DataError: the folder cannot be read or written.
        """
