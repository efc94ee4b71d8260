"""Protocol of memories: what is kept of an observed trajectory, and recalled for a question.

A memory observes a trajectory step by step, and recalls frames and texts within a budget of tokens
when it is asked. The harness shows these, and the current view, to the model under test. The shape
is that of LongMemEval-V2's memories (insert a trajectory, query with a text and an image), a step
at a time, so that an agent can use it as it acts.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.step_log import ObjectLog, Step

# Tokens of a recalled text are estimated, as no tokenizer is at hand for a model behind a server;
# the tables have the tokens that the model itself counted.
CHARACTERS_PER_TOKEN = 4


@dataclass(frozen=True, kw_only=True)
class MemoryCapabilities:
    """What a memory needs and is.

    Attributes:
        privileged: it is given what no agent can know: the simulator's metadata of each step, and a
            question's clues.
        writes: it asks the model under test for texts (`TrajectoryFacts.write`).
        deterministic: the same observations and query recall the same.
        cache: what cuts the model's cache, MODULE:CLASS; None if what is recalled is shown. All
            frames are encoded, and of their keys and values those of the recalled ones are kept, or
            what that class chooses within the budget (`infthor_eval.memory.caches`).
    """

    privileged: bool = False
    writes: bool = False
    deterministic: bool = True
    cache: str | None = None


# Asks the model under test: given texts and frames in order and the limit of the reply in tokens,
# returns the reply. Raises DataError if a frame cannot be read, ModelError if the model cannot take
# so many.
Write = Callable[[Sequence["str | FrameRef"], int], str]


@dataclass(frozen=True, kw_only=True)
class TrajectoryFacts:
    """What is known of a trajectory before its first step.

    Attributes:
        name: name of the trajectory; of twins, that of their base.
        tokens_per_frame: tokens of a frame for the model under test; None if it is not known, then
            there is no budget.
        seed: seed of whatever the memory draws.
        write: asks the model under test; None unless the memory's capabilities say `writes`.
    """

    name: str
    tokens_per_frame: int | None = None
    seed: int = 0
    write: Write | None = None


@dataclass(frozen=True, kw_only=True)
class Observation:
    """A step of a trajectory as its agent sees it.

    Attributes:
        number: position of the frame in the trajectory's time order, from 0.
        frame: the view after the action.
        action: the low-level action before the frame ("PickupObject Mug"); None at the first frame,
            and if not known.
        goal: the goal that the agent is at; None if it is not known.
        log: the simulator's metadata of the step; None unless the memory is privileged.
        step: the whole entry of the step in the trajectory's log, with instances; likewise, and
            None where an agent acts.
    """

    number: int
    frame: FrameRef
    action: str | None = None
    goal: str | None = None
    log: ObjectLog | None = None
    step: Step | None = None


@dataclass(frozen=True, kw_only=True)
class Query:
    """What a memory is asked for.

    Attributes:
        text: the question, or an agent's goal and plan.
        present: the current step, whose frame the model is shown beside what is recalled.
        clues: numbers of the observations with the evidence, ascending; None unless the memory is
            privileged.
    """

    text: str
    present: Observation
    clues: tuple[int, ...] | None = None


# What is recalled, in the order in which the model is shown it: observations (their frames are
# shown) and texts.
Recalled = Sequence[Observation | str]


@runtime_checkable
class Memory(Protocol):
    """Keeps and recalls parts of a trajectory. One object serves one trajectory after another.

    Its class is called with the options that a user gives (`--memory-args`), each with a default.
    """

    @property
    def capabilities(self) -> MemoryCapabilities:
        """What the memory needs and is."""

    def identity(self) -> Mapping[str, Any]:
        """Return what can change a recall beside class and options, as JSON: a checkpoint, say."""

    def begin(self, facts: TrajectoryFacts) -> None:
        """Forget everything and begin a trajectory."""

    def observe(self, observation: Observation) -> None:
        """Take the next step of the trajectory; it may come after recalls for earlier moments.

        Raises:
            DataError: its frame cannot be read.
        """

    def recall(self, query: Query, budget: int | None) -> Recalled:
        """Return what is shown before the current view, in order. Recalling changes nothing.

        Args:
            query: what is asked, and the current step, which has not been observed.
            budget: most tokens (`tokens_of`); None for the memory's own limit.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the model under test cannot write, or another model behind the memory fails.
        """


def tokens_of(recalled: Recalled, tokens_per_frame: int) -> int:
    """Return the tokens of what is recalled: its frames', and an estimate of its texts'."""
    texts = [piece for piece in recalled if isinstance(piece, str)]
    of_texts = sum(math.ceil(len(text) / CHARACTERS_PER_TOKEN) for text in texts)
    return of_texts + tokens_per_frame * (len(recalled) - len(texts))
