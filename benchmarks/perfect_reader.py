"""A reader that makes no mistake: what a memory is worth to a model that sees all in its frames.

infthor-eval --model benchmarks/perfect_reader.py:PerfectReader --tasks nieh_mini_twins \\
    --context memory --memory oracle,uniform,random,last --budget 60 --tokens-per-frame 16

It answers from what the shown frames' pictures show, by the logs of the set that the frames are of
(objects that are large enough to be seen, no actions), with the independent solver that checks
questions. It knows neither the other frames nor the answer key. Where what is shown does not tell,
it says what a person would: "no" if asked whether something is there, otherwise "not sure".
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.step_log import Step, read_steps
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.history import DEFAULT_SHARE
from infthor_eval.nieh.samples import find_set
from model_adapters import (
    Capabilities,
    Decoding,
    Reply,
    Transcript,
    check_decoding,
    check_turns,
    cut_at_stop,
)

_CAPABILITIES = Capabilities(counts_tokens=False, token_ids=False)
_YES_OR_NO = ("Is ", "Was ", "Did ", "Have ")
_UNKNOWN = "not sure"


@dataclass(frozen=True)
class ReaderOptions:
    """Options of the reader.

    Attributes:
        bundled: name of the bundled set that the frames are of.
        data: folder of another set that they are of; "" for the bundled one.
    """

    bundled: str = "nieh_mini_twins"
    data: str = ""


class _Log:
    """A trajectory of a set: its log, and where each picture stands in time."""

    def __init__(self, questions: NiehSet, traj_id: str) -> None:
        self._folder = questions.folder(traj_id)
        self._frames = questions.frames(traj_id)

    @cached_property
    def steps(self) -> Sequence[Step]:
        """Its log; it is read when it is needed."""
        return read_steps(self._folder)

    @cached_property
    def checker(self) -> Checker:
        """The solver on it."""
        return Checker(self.steps, DEFAULT_SHARE)

    @cached_property
    def places(self) -> dict[FrameRef, list[int]]:
        """Positions of each picture."""
        places: dict[FrameRef, list[int]] = {}
        for at, frame in enumerate(self._frames):
            places.setdefault(frame, []).append(at)
        return places

    def find(self, shown: Sequence[FrameRef]) -> list[int] | None:
        """Return the numbers of shown frames; None if they are not of this trajectory.

        A picture may be that of several steps: they are in order, and as many as can be follow each
        other, as a memory that keeps what happened has both frames of it.
        """
        paths: dict[int, tuple[int, list[int]]] = {-2: (0, [])}  # by the last position
        for frame in shown:
            longer: dict[int, tuple[int, list[int]]] = {}
            for place in self.places.get(frame, ()):
                before = [
                    (n + (place == at + 1), path) for at, (n, path) in paths.items() if at < place
                ]
                if before:
                    n_following, path = max(before, key=lambda item: item[0])
                    longer[place] = (n_following, [*path, place])
            paths = longer
        if not paths:
            return None
        _, best = max(paths.values(), key=lambda item: item[0])
        return [self.steps[at].img_idx for at in best]


class PerfectReader:
    """Answers from the logged states of what the shown frames show."""

    Options = ReaderOptions
    capabilities = _CAPABILITIES

    def __init__(self, name: str, options: ReaderOptions) -> None:
        self.name = name
        self._options = options
        bundled = None if options.data else options.bundled
        self._set = find_set(data=options.data or None, bundled=bundled)

    @classmethod
    def build(cls, name: str, options: ReaderOptions, seed: int) -> "PerfectReader":  # noqa: ARG003
        """Open the set; nothing is drawn."""
        return cls(name, options)

    def identity(self) -> dict[str, Any]:
        """The set."""
        return {**asdict(self._options), "set": self._set.fingerprint}

    def tokens_per_frame(self, frame: FrameRef) -> None:
        """Tokens are not counted."""
        return

    def conversation(self) -> "_Talk":
        """Begin a conversation."""
        return _Talk(self)

    def close(self) -> None:
        """Nothing is held."""

    def answer(self, shown: Sequence[FrameRef], text: str) -> str:
        """Return the answer to the question in a text, by the frames that are shown."""
        question = max((words for words in self._questions if words in text), key=len, default=None)
        if question is None:
            return _UNKNOWN
        answers = self._answers(question, shown)
        if answers is not None:
            return ", ".join(answers)
        return "no" if question.startswith(_YES_OR_NO) else _UNKNOWN

    def _answers(self, question: str, shown: Sequence[FrameRef]) -> tuple[str, ...] | None:
        """Return what shown frames say, by the first trajectory that has them all; None if nothing.

        In both worlds of a pair what equal frames show is equal, so that either will do.
        """
        for log in self._logs:
            numbers = log.find(shown)
            if numbers is not None:
                return log.checker.answers(question, numbers)
        return None

    @cached_property
    def _questions(self) -> frozenset[str]:
        return frozenset(question.text for question in self._set.questions)

    @cached_property
    def _logs(self) -> list[_Log]:
        names = sorted({question.traj_id for question in self._set.questions})
        return [_Log(self._set, name) for name in names]


class _Talk(Transcript):
    n_tokens = None

    def __init__(self, model: PerfectReader) -> None:
        super().__init__()
        self._model = model

    def reply(self, decoding: Decoding) -> Reply:
        """Answer the last question."""
        check_decoding(self._model.name, _CAPABILITIES, decoding)
        check_turns(self._model.name, _CAPABILITIES, self.turns)
        parts = [part for turn in self.turns for part in turn.parts]
        shown = [part for part in parts if isinstance(part, FrameRef)]
        text = "".join(part for part in parts if isinstance(part, str))
        reply = self._model.answer(shown, text)
        cut = cut_at_stop(reply, decoding.stop)
        return Reply(reply if cut is None else cut)
