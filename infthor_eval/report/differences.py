"""Where two runs of the same questions differ: question by question, and what that can be due to.

What each question carries of the difference of the mean scores adds up to all of it: a question of
both runs carries its own difference, one of one run alone what it moves that run's mean by.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile
from statistics import fmean
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.report.causes import Effect
from infthor_eval.report.descriptions import THOUGHT
from infthor_eval.report.presenter import ReplyTokens
from infthor_eval.report.same_questions import Side, find_sides
from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord

Record = UnitRecord[Any]


@dataclass(frozen=True)
class Answer:
    """What a run has of a question.

    Attributes:
        state: the state of its record; "not in the run" if there is none.
        reason: why there is no result; empty if there is one, or no record.
        text: what the model thought, if it did, and its reply.
        score: the score by the main metric; None without a result.
        tokens: the reply's tokens, if they were recorded.
    """

    state: str
    reason: str = ""
    text: str = ""
    score: float | None = None
    tokens: ReplyTokens | None = None


@dataclass(frozen=True)
class QuestionDifference:
    """A question that differs between two runs.

    Attributes:
        question: its words.
        answers: what each of the runs has of it.
        effects: how it differs.
        possible: how it may differ besides, as the records do not tell.
        carries: its part of the difference of the runs' mean scores, the second less the first.
    """

    question: str
    answers: tuple[Answer, Answer]
    effects: frozenset[Effect]
    possible: frozenset[Effect]
    carries: float

    @property
    def diverges_at(self) -> int | None:
        """The first character that differs, from 1; None if the replies are equal, or one is
        missing."""
        first, second = self.answers
        if first.score is None or second.score is None or first.text == second.text:
            return None
        return 1 + _n_equal(first.text, second.text)

    @property
    def token(self) -> int | None:
        """The first token of the reply that differs, from 1; None if there is none, or its tokens
        were not recorded."""
        first, second = (answer.tokens for answer in self.answers)
        return None if first is None or second is None else differing_token(first, second)

    @property
    def margin(self) -> float | None:
        """How much likelier than the second the token was that the surer run chose there, in nats;
        None if that was not recorded."""
        first, second = (answer.tokens for answer in self.answers)
        return None if first is None or second is None else margin_of_difference(first, second)

    @property
    def is_near_tie(self) -> bool:
        """Whether both runs read the same, and rounding alone may have chosen another token."""
        margin = self.margin
        is_alike = self.effects <= {Effect.REPLY, Effect.CUT} and not self.possible
        return is_alike and margin is not None and margin <= NEAR_TIE


def differing_token(first: ReplyTokens, second: ReplyTokens) -> int | None:
    """Return the first token that differs between two replies, from 1; None if there is none."""
    return None if first.ids == second.ids else 1 + _n_equal(first.ids, second.ids)


def margin_of_difference(first: ReplyTokens, second: ReplyTokens) -> float | None:
    """Return how much likelier than the second the token was that the surer reply has where they
    first differ, in nats; None if they do not, or that was not recorded."""
    at = differing_token(first, second)
    if at is None:
        return None
    margins = (first.margins, second.margins)
    # One that was cut off at its longest has no token there.
    return max((of_reply[at - 1] for of_reply in margins if len(of_reply) >= at), default=None)


def _n_equal(first: Sequence[Any], second: Sequence[Any]) -> int:
    """Return how many items two sequences begin with alike."""
    pairs = zip(first, second, strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


@dataclass(frozen=True)
class Compared:
    """Two runs compared question by question.

    Attributes:
        n_shared: number of questions with a result in both, those that were repeated once for each
            repetition.
        means: the mean score of each run, over all of its results.
        differences: the questions that differ, those that carry most first.
    """

    n_shared: int
    means: tuple[float, float]
    differences: Sequence[QuestionDifference]


# Nats between two tokens that rounding may exchange: both runs round a logit, and bfloat16 has
# steps of an eighth where logits are from 16 to 32.
NEAR_TIE = 0.25


@dataclass(frozen=True)
class _Pair:
    """A question of two runs: the records, and whether both decode replies alike."""

    first: Record | None
    second: Record | None
    same_decoding: bool


def compare_questions(first: Run, second: Run) -> Compared:
    """Compare two runs of one suite question by question.

    A task and variant (a depth) is compared with that of its name; a run's only one with the only
    one of the other run, whatever its name.
    """
    runs = (first, second)
    pairs = list(_pairs(runs))
    answers = [(_answer(first, pair.first), _answer(second, pair.second)) for pair in pairs]
    scores: tuple[list[float], list[float]] = ([], [])
    shared: tuple[list[float], list[float]] = ([], [])
    for both in answers:
        is_shared = all(answer.score is not None for answer in both)
        for place, answer in enumerate(both):
            if answer.score is not None:
                scores[place].append(answer.score)
                if is_shared:
                    shared[place].append(answer.score)
    if not shared[0]:
        raise DataError(
            f"{first.folder} and {second.folder} share no question of one task with a result in "
            "both; explain runs of the same questions"
        )
    means = fmean(shared[0]), fmean(shared[1])
    n_answered = len(scores[0]), len(scores[1])
    differences = []
    for pair, both in zip(pairs, answers, strict=True):
        effects = _effects(runs, pair, both)
        if effects:
            record = pair.first or pair.second
            assert record is not None
            possible = _unexplained(pair, effects)
            title = first.presenter.describe(record).title
            carries = _carries(both, len(shared[0]), means, n_answered)
            differences.append(QuestionDifference(title, both, effects, possible, carries))
    differences.sort(key=lambda difference: -abs(difference.carries))
    return Compared(len(shared[0]), (fmean(scores[0]), fmean(scores[1])), differences)


def _pairs(runs: tuple[Run, Run]) -> Iterator[_Pair]:
    for first, second in _paired_sides(find_sides(runs)):
        records = [_by_key(side) for side in (first, second)]
        same = first is not None and second is not None and _decode_alike(runs, (first, second))
        for key in dict.fromkeys((*records[0], *records[1])):
            yield _Pair(records[0].get(key), records[1].get(key), same)


def _paired_sides(sides: Sequence[Side]) -> Iterator[tuple[Side | None, Side | None]]:
    by_run = [
        {(side.task, side.variant): side for side in sides if side.run == run} for run in (0, 1)
    ]
    if all(len(of_run) == 1 for of_run in by_run):
        yield next(iter(by_run[0].values())), next(iter(by_run[1].values()))
        return
    for name in dict.fromkeys((*by_run[0], *by_run[1])):
        yield by_run[0].get(name), by_run[1].get(name)


def _by_key(side: Side | None) -> dict[UnitKey, Record]:
    return {} if side is None else {record.key: record for record in side.records}


def _decode_alike(runs: tuple[Run, Run], sides: tuple[Side, Side]) -> bool:
    """Return whether the runs decode alike: only then do hashes of requests show other differences.

    Hashes of imported replies are of the replies.
    """
    configs = [run.header.config for run in runs]
    if any(config.model.get("imported") for config in configs):
        return False
    decoding = [
        config.document["tasks"][side.task].get("decoding")
        for config, side in zip(configs, sides, strict=True)
    ]
    return bool(decoding[0] == decoding[1])


def _answer(run: Run, record: Record | None) -> Answer:
    if record is None:
        return Answer("not in the run")
    if record.state != "answered":
        return Answer(record.state, record.failure or record.excluded or "")
    thought = run.presenter.details(record).get(THOUGHT)
    reply = run.presenter.reply(record)
    text = reply if thought is None else f"{thought}\n{reply}"
    tokens = run.presenter.reply_tokens(record)
    return Answer(record.state, text=text, score=run.main_score(record), tokens=tokens)


def _effects(
    runs: tuple[Run, Run], pair: _Pair, answers: tuple[Answer, Answer]
) -> frozenset[Effect]:
    n_answered = sum(answer.score is not None for answer in answers)
    if n_answered == 0:
        return frozenset()
    if n_answered == 1:
        is_absent = pair.first is None or pair.second is None
        return frozenset({Effect.ASKED if is_absent else Effect.FAILED})
    assert pair.first is not None
    assert pair.second is not None
    first, second = (answer.text for answer in answers)
    if first == second:
        scored = _scores_differ(runs, (pair.first, pair.second))
        return frozenset({Effect.SCORES} if scored else ())
    effects = {Effect.REPLY}
    if first.startswith(second) or second.startswith(first):
        effects.add(Effect.CUT)
    return frozenset(effects | _request_effects(pair.first, pair.second, pair.same_decoding))


def _scores_differ(runs: tuple[Run, Run], records: tuple[Record, Record]) -> bool:
    first, second = (run.suite.scores(record) for run, record in zip(runs, records, strict=True))
    if any(first[name] != second[name] for name in first.keys() & second.keys()):
        return True
    main = [run.main_score(record) for run, record in zip(runs, records, strict=True)]
    return main[0] != main[1]


def _request_effects(first: Record, second: Record, same_decoding: bool) -> set[Effect]:
    """Return how what was read differs, as far as hashes and counts of tokens tell."""
    if same_decoding and first.fingerprint != second.fingerprint:
        return {Effect.REQUEST}
    read = first.read, second.read
    effects: set[Effect] = set()
    tokens = _differ(read[0].context, read[1].context)
    if tokens or (tokens is None and _differ(first.tokens.context, second.tokens.context)):
        effects.add(Effect.TOKENS)
    if _differ(read[0].frames, read[1].frames):
        effects.add(Effect.PIXELS)
    return effects | ({Effect.REQUEST} if effects and not same_decoding else set())


def _unexplained(pair: _Pair, effects: frozenset[Effect]) -> frozenset[Effect]:
    """Return how what was read may differ besides, where the records do not tell."""
    first, second = pair.first, pair.second
    if Effect.REPLY not in effects or Effect.REQUEST in effects:
        return frozenset()
    assert first is not None
    assert second is not None
    tokens_known = _differ(first.read.context, second.read.context) is not None
    frames_known = _differ(first.read.frames, second.read.frames) is not None
    told = {
        Effect.REQUEST: pair.same_decoding or (tokens_known and frames_known),
        Effect.TOKENS: tokens_known or Effect.TOKENS in effects,
        Effect.PIXELS: frames_known,
    }
    return frozenset(effect for effect, is_told in told.items() if not is_told)


def _differ(first: object, second: object) -> bool | None:
    """Return whether two values differ; None if one is not known."""
    return None if first is None or second is None else first != second


def _carries(
    answers: tuple[Answer, Answer],
    n_shared: int,
    means: tuple[float, float],
    n_answered: tuple[int, int],
) -> float:
    """Return what a question carries of the difference of two means.

    Args:
        answers: what the runs have of it.
        n_shared: number of questions with a result in both.
        means: mean scores over those.
        n_answered: number of results of each run.
    """
    first, second = (answer.score for answer in answers)
    if first is not None and second is not None:
        return (second - first) / n_shared
    if second is not None:
        return (second - means[1]) / n_answered[1]
    assert first is not None
    return (means[0] - first) / n_answered[0]
