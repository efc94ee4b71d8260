"""A model as an actor: it continues the sequence that it was trained on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from infthor_eval.errors import ModelError
from infthor_eval.formats.blank import blank_like
from infthor_eval.formats.digests import seed_of
from infthor_eval.formats.frames import FrameRef
from infthor_eval.household.sequence_text import ACT
from infthor_eval.plans.actors import Act, Situation
from infthor_eval.plans.environment import StepOutcome
from infthor_eval.plans.history import Part
from infthor_eval.plans.memory import Memory
from infthor_eval.thor.actions import applicable_actions
from model_adapters import Decoding, Model, wrap_request_errors

__all__ = ["Manner", "ModelActor"]

_LONGEST = 64  # tokens of an action's text, where replies are held to such texts


@dataclass(frozen=True)
class Manner:
    """How a model is led through a trajectory.

    Attributes:
        decoding: of each action; draws have a seed of their own each time.
        memory: what it is given of the history.
        preamble: what it is told before everything else; empty as published.
        constrained: whether its replies are held to the actions that are possible in view.
        blank: whether it is shown grey frames instead of those that there are.
    """

    decoding: Decoding
    memory: Memory
    preamble: str = ""
    constrained: bool = False
    blank: bool = False


class ModelActor:
    """Asks a model for one action after the other; what it has seen is appended to and never changed."""

    def __init__(self, model: Model, manner: Manner) -> None:
        self._model = model
        self._manner = manner
        self._conversation = model.conversation()
        self._start = self._conversation.mark()

    def begin(self, situation: Situation) -> None:
        """See `Actor`."""
        environment, plan = situation.environment, situation.plan.index
        self._seed, self._n_acts = situation.seed, 0
        self._observation = situation.observation
        with wrap_request_errors(self._model.name):
            parts = self._manner.memory.recall(environment.past(plan), self._count)
            self._conversation.rewind(self._start)
            self._conversation.append(self._manner.preamble, *self._shown(parts), ACT)

    def act(self) -> Act:
        """See `Actor`."""
        decoding = replace(self._manner.decoding, seed=seed_of(f"{self._seed}/{self._n_acts}"))
        if self._manner.constrained:
            possible = tuple(str(text) for text in applicable_actions(self._observation.view))
            decoding = replace(decoding, choices=possible, max_new_tokens=max(decoding.max_new_tokens, _LONGEST))
        self._n_acts += 1
        with wrap_request_errors(self._model.name):
            reply = self._conversation.reply(decoding)
        return Act(reply.text, reply)

    def saw(self, outcome: StepOutcome) -> None:
        """See `Actor`."""
        self._observation = outcome.observation
        frame = outcome.observation.frame
        if frame is None:
            raise ModelError("the environment keeps no frames, which a model wants to see")
        self._conversation.append(f"{outcome.info.action}{ACT}", *self._shown([frame]), ACT)

    def _shown(self, parts: Sequence[Part]) -> list[Part]:
        if not self._manner.blank:
            return list(parts)
        return [blank_like(part) if isinstance(part, FrameRef) else part for part in parts]

    def _count(self, parts: Sequence[Part]) -> int | None:
        self._conversation.rewind(self._start)
        self._conversation.append(self._manner.preamble, *self._shown(parts), ACT)
        return self._conversation.n_tokens
