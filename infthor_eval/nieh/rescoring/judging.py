"""A judge: a model asked whether a reply is right where the rules are unsure, and its reliability.

The metric `judged` is the strict score, or the judge's where the rules are unsure
(`infthor_eval.nieh.rescoring.unsure`) and it gives more: 1 for a yes. A no leaves what the rules
found: 0, or the share of several gold answers. So does a judge that gives no verdict.

The judge is measured on replies of which the rules are sure: it should find the right ones right
and the wrong ones wrong.
"""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import msgspec

from infthor_eval.errors import DataError, ModelError, UsageError, unknown_name
from infthor_eval.nieh.records import NiehAnswer, NiehVerdict
from infthor_eval.nieh.rescoring.judge_prompts import JUDGE_PROMPTS, YES_NO
from infthor_eval.nieh.rescoring.unsure import KnownAnswers
from infthor_eval.nieh.results.summary import is_open_ended
from infthor_eval.nieh.scoring import response_of
from infthor_eval.runs import Session, Unit, UnitKey, UnitRecord, Usage
from infthor_eval.runs.limiting import limit_items
from infthor_eval.storage.deadlines import limit_time
from infthor_eval.storage.digests import fingerprint
from infthor_eval.storage.limits import JUDGE_SECONDS
from model_adapters import (
    Decoding,
    Model,
    Reply,
    adapter_identity,
    answer_of,
    check_options,
    identity_of,
    is_known,
    label,
    load,
    names,
    refuse_batches,
    wrap_request_errors,
)

JUDGED = "judged"  # the metric

_N_SAMPLED = 25  # replies of each kind, right and wrong, on which a judge is measured

Record = UnitRecord[NiehAnswer]
Track = Callable[[Sequence[Record]], Iterable[Record]]


class Verdicts(msgspec.Struct, frozen=True, kw_only=True):
    """A judge's verdicts on n replies: right, partly right, wrong, neither, or request failed."""

    n: int
    n_right: int
    n_partly: int
    n_wrong: int
    n_neither: int
    n_not_asked: int


class Agreement(msgspec.Struct, frozen=True, kw_only=True):
    """What a judge says, and how it agrees with the rules.

    Attributes:
        unsure: its verdicts on the replies of which the rules are unsure.
        right: those on sampled replies with full marks.
        wrong: those on sampled replies that are plainly wrong.
    """

    unsure: Verdicts
    right: Verdicts
    wrong: Verdicts

    @property
    def share(self) -> float | None:
        """Share of the sampled replies on which judge and rules agree, 0 to 1; None without any."""
        n = sum(sampled.n - sampled.n_not_asked for sampled in (self.right, self.wrong))
        return (self.right.n_right + self.wrong.n_wrong) / n if n else None


@dataclass(frozen=True)
class Judgement:
    """The replies of a run, judged.

    Attributes:
        scores: the metric `judged` of each reply.
        agreement: how judge and rules agree.
        failures: why the judge could not be asked, for each reply that it could not be asked about.
    """

    scores: Mapping[UnitKey, float]
    agreement: Agreement
    failures: Sequence[str]


class Judge:
    """A model that judges replies.

    Attributes:
        name: its name, with the checkpoint if there is one.
        seed: seed of the sample on which it is measured.
        prompt: name of the form in which it is asked (`infthor_eval.nieh.rescoring.judge_prompts`).
    """

    def __init__(
        self,
        model: Model,
        name: str,
        code: Mapping[str, Any],
        max_new_tokens: int,
        seed: int,
        prompt: str = YES_NO,
    ) -> None:
        """Take a model, its name for people, its adapter's identity, and the limit of a verdict."""
        self.name = name
        self.seed = seed
        self.prompt = prompt
        self._form = JUDGE_PROMPTS[prompt]
        self._model = model
        self._decoding = Decoding(max_new_tokens=max_new_tokens)
        self._identity = {"name": model.name, **identity_of(model), "adapter": code}
        self._conversation = model.conversation()
        if self._form.system:
            self._conversation.append(self._form.system, role="system")
        self._start = self._conversation.mark()

    @classmethod
    def load(
        cls,
        name: str,
        options: Mapping[str, str],
        max_new_tokens: int,
        seed: int,
        prompt: str = YES_NO,
    ) -> Self:
        """Load the judge of a model's name."""
        if not is_known(name):
            raise unknown_name("model", name, names())
        check_options(name, options)
        code = adapter_identity(name)
        model = load(name, options, seed)
        refuse_batches(model)
        if not isinstance(model, Model):
            model.close()
            raise UsageError(
                f"--judge {name}: cannot be asked, as it does not answer in words; give another "
                "model"
            )
        return cls(model, label(name, options), code, max_new_tokens, seed, prompt)

    def config(self) -> dict[str, Any]:
        """Return everything that verdicts and sample depend on, as JSON values."""
        settings = {
            "decoding": self._decoding.document(),
            "prompt": self.prompt,
            "sample_seed": self.seed,
        }
        return {"label": self.name, **self._identity, **settings}

    def verdict(self, record: Record, session: Session[NiehAnswer]) -> float | None:
        """Return the judge's score, 0 to 1; None if it gives none. The session's verdict is
        reused."""
        payload = record.payload
        response = response_of(payload.reply or "", payload.answers)
        text = self._form.text(payload.question, payload.answers, response)
        request = {"system": self._form.system, "text": text, "decoding": self._decoding.document()}
        inputs = fingerprint({"judge": self._identity, **request})
        known = session.find_artifact(inputs, NiehVerdict)
        if known is not None:  # what it said is read as of today
            return self._form.read(answer_of(Reply(known.said)).answer)
        start = time.perf_counter()
        seconds = JUDGE_SECONDS.value
        late = f"{self.name} gives no verdict within {seconds} s; {JUDGE_SECONDS.hint}"
        with wrap_request_errors(self.name), limit_time(seconds, ModelError(late)):
            self._conversation.rewind(self._start)
            self._conversation.append(text)
            reply = self._conversation.reply(self._decoding)
        verdict = NiehVerdict(
            question=payload.question,
            answers=payload.answers,
            reply=response,
            said=reply.text,
            score=self._form.read(answer_of(reply).answer),
            judge=self._identity,
            seconds=round(time.perf_counter() - start, 4),
        )
        session.cache_artifact(inputs, verdict, Usage.of([reply]))
        return verdict.score

    def close(self) -> None:
        """Free the model."""
        self._model.close()


def judge_replies(
    records: Sequence[Record], judge: Judge, session: Session[NiehAnswer], track: Track = list
) -> Judgement:
    """Judge the replies of a run.

    Args:
        records: all records of the run, with today's strict scores; those without scores are left
            out.
        judge: the judge.
        session: the journal that has the verdicts.
        track: wraps the replies that the judge is asked about, to show its progress.
    """
    known = KnownAnswers(records)
    scored = [record for record in records if record.payload.scores]
    unsure = [record for record in scored if known.is_unsure(record)]
    right, wrong = _sample(scored, {record.key for record in unsure}, judge.seed)
    verdicts: dict[UnitKey, float | None] = {}
    failures = []
    for record in track([*unsure, *right, *wrong]):
        try:
            verdicts[record.key] = judge.verdict(record, session)
        except (DataError, ModelError) as error:
            failures.append(
                session.describe_failure(Unit(record.key, record.cluster, record.payload), error)
            )
    agreement = Agreement(
        unsure=_count(unsure, verdicts),
        right=_count(right, verdicts),
        wrong=_count(wrong, verdicts),
    )
    judged = {record.key: verdicts.get(record.key) or 0.0 for record in unsure}
    scores = {r.key: max(judged.get(r.key, 0.0), r.payload.scores["strict"]) for r in scored}
    return Judgement(scores, agreement, failures)


def _sample(
    scored: Sequence[Record], unsure: set[UnitKey], seed: int
) -> tuple[list[Record], list[Record]]:
    """Return open-ended replies that are right, and plainly wrong ones, from all trajectories."""
    sure = [
        record
        for record in scored
        if is_open_ended(record)
        and record.key not in unsure
        and (record.payload.reply or "").strip()
    ]

    def sample(score: float) -> list[Record]:
        chosen = [record for record in sure if record.payload.scores["strict"] == score]
        return limit_items(chosen, lambda record: record.cluster, seed, _N_SAMPLED)

    return sample(1.0), sample(0.0)


def _count(records: Sequence[Record], verdicts: Mapping[UnitKey, float | None]) -> Verdicts:
    scores = [verdicts[record.key] for record in records if record.key in verdicts]
    n_partly = sum(score is not None and 0 < score < 1 for score in scores)
    counts = {
        "n_right": scores.count(1.0),
        "n_wrong": scores.count(0.0),
        "n_neither": scores.count(None),
    }
    return Verdicts(
        n=len(records), n_partly=n_partly, n_not_asked=len(records) - len(scores), **counts
    )
