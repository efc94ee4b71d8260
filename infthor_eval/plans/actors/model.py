"""A model as an actor: it continues the sequence that it was trained on.

To add or change how an agent is asked and read: here; the words in
`infthor_eval/household/sequence_text.py` and `infthor_eval/formats/object_ids.py`, actions in
`infthor_eval/thor/actions.py`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.pictures.blank import blank_like
from infthor_eval.household.sequence_text import ACT, action_part
from infthor_eval.plans.actors.protocols import Act, PlanSituation
from infthor_eval.plans.environment import StepOutcome
from infthor_eval.plans.history.past import History
from infthor_eval.plans.history.segments import Part
from infthor_eval.plans.published.final_protocol import (
    FinalForm,
    present_parts,
    with_recorded_state,
)
from infthor_eval.runs import StoredRequest
from infthor_eval.storage.digests import seed_of
from infthor_eval.thor.actions import applicable_actions
from model_adapters import Decoding, Model, answer_of, wrap_request_errors

_MAX_ACTION_TOKENS = 64  # if replies are restricted to texts of actions, which must not be cut


@dataclass(frozen=True)
class AgentConfig:
    """How a model is prompted, and how its actions are decoded, each draw with its own seed.

    Attributes:
        history: the part of the history that it is given.
        words: words of actions.
        form: the published form of final tasks, or of a chat; None elsewhere.
        preamble: text before everything else; empty as published.
        constrained: whether its replies are restricted to the actions that are possible in view.
        blank: whether it is shown grey frames instead of the actual ones.
    """

    decoding: Decoding
    history: History
    words: Words
    form: FinalForm | None = None
    preamble: str = ""
    constrained: bool = False
    blank: bool = False


class ModelActor:
    """Asks a model for one action after the other.

    Within a plan the conversation is only appended to, so that the model's prefix cache stays
    valid.
    """

    def __init__(self, model: Model, config: AgentConfig) -> None:
        self._model = model
        self._config = config
        self._conversation = model.conversation()
        if config.form is not None:
            self._conversation.append(config.form.system, role="system")
        self._start = self._conversation.mark()
        self._recalled: Sequence[Part] = ()
        self.request: StoredRequest | None = None

    def begin(self, situation: PlanSituation) -> None:
        """See `PlanActor`."""
        environment = situation.environment
        plan = situation.plan.index
        self._seed = situation.seed
        self._n_acts = 0
        self._observation = situation.observation
        if situation.goes_on:
            return
        past = environment.past(plan)
        if self._config.form is not None:
            past = with_recorded_state(past, environment.trajectory, situation.plan.low[0])
        self._past = past
        with wrap_request_errors(self._model.name):
            recalled = self._config.history.recall(past, self._count)
            self.request = self._stored_request(recalled)
            self._recalled = recalled
            self._restart(self._recalled)

    def _stored_request(self, recalled: Sequence[Part]) -> StoredRequest:
        """Return what is recalled, as the journal has it: behind what the plan before was given."""
        places = {step.frame: step.number for step in self._past.observations()}
        form = self._config.form
        opening = ("" if form is None else form.system, self._config.preamble)
        n_before = len(self._recalled) if self.request is not None else 0
        goes_on = n_before > 0 and list(recalled[:n_before]) == list(self._recalled)
        return StoredRequest.of(
            recalled[n_before:] if goes_on else (*opening, *recalled),
            places_of=lambda frames: [places[frame] for frame in frames if frame in places],
            what="frames (blank)" if self._config.blank else "frames",
            after=self.request.fingerprint if goes_on and self.request is not None else "",
        )

    def act(self) -> Act:
        """See `PlanActor`."""
        decoding = replace(self._config.decoding, seed=seed_of(f"{self._seed}/{self._n_acts}"))
        if self._config.constrained:
            actions = applicable_actions(self._observation.view, self._config.words)
            possible = tuple(map(str, actions))
            max_new_tokens = max(decoding.max_new_tokens, _MAX_ACTION_TOKENS)
            decoding = replace(decoding, choices=possible, max_new_tokens=max_new_tokens)
        self._n_acts += 1
        if self._asks_anew:
            self._restart([*self._recalled, *present_parts(self._present_frame())])
        with wrap_request_errors(self._model.name):
            reply = self._conversation.reply(decoding)
        return Act(answer_of(reply).answer, reply)

    def observe(self, outcome: StepOutcome) -> None:
        """See `PlanActor`; the action is appended as it was understood, not as it was written."""
        self._observation = outcome.observation
        if self._asks_anew:
            return
        frame = self._present_frame()
        self._conversation.append(f"{outcome.info.action}{ACT}", *self._visible_parts([frame]), ACT)

    def tokens_between(self, first: int, last: int) -> int | None:
        """See `AskingActor`."""
        parts: list[Part] = []
        # Of the parts up to each frame; a task's first frame is there again behind its goal.
        ends: list[int] = []
        for segment in self._past.all:
            parts += segment.opening()
            ends += [] if ends else [parts.index(segment.before) + 1]
            for action, frame in segment.steps:
                parts += action_part(action), frame
                ends.append(len(parts))
        counts = [self._count(parts[: ends[frame]]) for frame in (first, last)]
        self._restart(self._recalled)
        return None if counts[0] is None or counts[1] is None else counts[1] - counts[0]

    @property
    def _asks_anew(self) -> bool:
        return self._config.form is not None and self._config.form.asks_anew

    def _present_frame(self) -> FrameRef:
        frame = self._observation.frame
        if frame is None:
            raise ModelError("the environment keeps no frames, which a model needs")
        return frame

    def _restart(self, parts: Sequence[Part]) -> None:
        self._conversation.rewind(self._start)
        ends = () if self._asks_anew else (ACT,)
        self._conversation.append(self._config.preamble, *self._visible_parts(parts), *ends)

    def _visible_parts(self, parts: Sequence[Part]) -> list[Part]:
        if not self._config.blank:
            return list(parts)
        return [blank_like(part) if isinstance(part, FrameRef) else part for part in parts]

    def _count(self, parts: Sequence[Part]) -> int | None:
        self._restart(parts)
        return self._conversation.n_tokens
