"""Why two runs of the same questions differ, in sentences and tables.

A cause is shown by a question where the question differs in a way of its own, as another hash of
the request is of other frames; it may be behind others that just have another reply.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from infthor_eval.errors import UsageError
from infthor_eval.report.causes import UNEXPLAINED, Cause, Effect, differing_causes
from infthor_eval.report.differences import (
    NEAR_TIE,
    Answer,
    Compared,
    QuestionDifference,
    compare_questions,
)
from infthor_eval.run import Run
from infthor_eval.tables import Column, Row, Table

_N_SHOWN = 5  # questions in the table, unless all are wanted
_LONGEST = 36  # characters of a value or a reply in a cell
_BEFORE = 12  # of these, before the first that differs
# A setting explains a question only if it can have one of these effects that the question shows;
# if none can, the first of them is named.
_NEEDED = (
    Effect.ASKED,
    Effect.FAILED,
    Effect.SCORES,
    Effect.REQUEST,
    Effect.TOKENS,
    Effect.PIXELS,
)
_ADVICE = {
    Effect.ASKED: "Run the command of the run that stopped again: it continues.",
    Effect.SCORES: "Score both again with `infthor-eval rescore`.",
    Effect.REQUEST: "The hashes of the requests differ: the content of the frames, or the words, "
    "changed between the runs.",
    Effect.TOKENS: "The same requests became other tokens: the template, the tokenizer or the size "
    "of images changed, and no setting says so.",
    Effect.PIXELS: "The same frames became other pixels: they were scaled differently, and "
    "no setting says so.",
    Effect.REPLY: "Ask one of them again with another --out to see whether the model repeats "
    "itself.",
}


@dataclass
class _Finding:
    """A cause, with the questions that it can explain, and how many of them show it."""

    cause: Cause
    questions: list[QuestionDifference] = field(default_factory=list)
    n_showing: int = 0

    @property
    def carries(self) -> float:
        return sum(question.carries for question in self.questions)

    @property
    def rank(self) -> tuple[float, int, int]:
        moved = sum(abs(question.carries) for question in self.questions)
        return (-round(moved, 9), -len(self.questions), -self.n_showing)


@dataclass(frozen=True)
class Explanation:
    """Why two runs differ.

    Attributes:
        runs: the runs.
        compared: where they differ.
        findings: the causes that differ; those that explain most first, last those that explain
            nothing.
    """

    runs: tuple[Run, Run]
    compared: Compared
    findings: Sequence[_Finding]

    @property
    def are_equal(self) -> bool:
        """Whether they have results of the same questions, with equal replies and scores."""
        return not self.compared.differences

    @property
    def are_near_ties(self) -> bool:
        """Whether they differ, and everywhere by tokens that rounding may exchange."""
        return not self.are_equal and all(it.is_near_tie for it in self.compared.differences)

    def sentences(self) -> Iterator[str]:
        """Yield what differs and why, the cause that explains most first."""
        for name, run in zip("AB", self.runs, strict=True):
            yield f"{name} is {run.label}, {run.folder}"
        if self.are_equal:
            yield f"Equal: replies and scores of {_count(self.compared.n_shared, 'question')}."
            if self.findings:
                names = ", ".join(finding.cause.name for finding in self.findings)
                yield f"Settings differ, and made no difference: {names}."
            return
        yield self._what_differs()
        near = sum(it.is_near_tie for it in self.compared.differences)
        if near:
            alone = "all" if self.are_near_ties else str(near)
            yield (
                f"Near ties: {alone} of these, which rounding can exchange. Both runs read the "
                f"same, and the token that differs was at most {NEAR_TIE} nats ahead in both."
            )
        explaining = [finding for finding in self.findings if finding.questions]
        is_shown = explaining[0].n_showing == len(explaining[0].questions)
        verb = "is" if is_shown else "can be"
        yield f"Most {verb} explained by {self._describe(explaining[0])}"
        alike = [it for it in explaining[1:] if it.rank == explaining[0].rank]
        if alike:
            names = ", ".join(finding.cause.name for finding in alike)
            yield (
                f"As much may be explained by: {names}. The records do not tell these apart; "
                "change one at a time."
            )
        for finding in explaining[1:]:
            if finding not in alike:
                yield f"Also: {self._describe(finding)}"

    def _what_differs(self) -> str:
        differing = self.compared.differences
        n_replies = sum(it.diverges_at is not None for it in differing)
        n_scores = sum(Effect.SCORES in it.effects for it in differing)
        n_alone = sum(bool(it.effects & {Effect.ASKED, Effect.FAILED}) for it in differing)
        parts = [f"{n_replies} of {self.compared.n_shared} replies differ"]
        parts += [f"{_count(n_scores, 'equal reply')} scored otherwise"] if n_scores else []
        parts += [f"{_count(n_alone, 'question')} with a result in one alone"] if n_alone else []
        first, second = (self._factor * mean for mean in self.compared.means)
        metric = self.runs[0].presenter.main_metric or "score"
        total = f"{metric} is {first:.2f} in A, {second:.2f} in B ({second - first:+.2f})"
        return f"Different: {', '.join(parts)}; {total}."

    def _describe(self, finding: _Finding) -> str:
        n = len(finding.questions)
        carried = f"{self._factor * finding.carries:+.2f}"
        of_all = f"{n} of the {len(self.compared.differences)} questions that differ, {carried}"
        settings = finding.cause.settings
        if not settings:
            return f"{finding.cause.name} ({of_all}). {self._advice(finding)}".rstrip()
        setting = settings[0]
        values = f"{setting.name} is {_short(setting.first)} in A, {_short(setting.second)} in B"
        more = f", and {_count(len(settings) - 1, 'more setting')}" if settings[1:] else ""
        return f"{finding.cause.name}: {values}{more} ({of_all})."

    def _advice(self, finding: _Finding) -> str:
        reasons = Counter(
            f"{answer.state}, {answer.reason}"
            for question in finding.questions
            for answer in question.answers
            if answer.reason
        )
        if reasons:
            reason, n = reasons.most_common(1)[0]
            return f"{n} {reason}."
        effect = next((it for it, cause in UNEXPLAINED.items() if cause is finding.cause), None)
        return "" if effect is None else _ADVICE.get(effect, "")

    @property
    def _factor(self) -> float:
        presenter = self.runs[0].presenter
        metric = presenter.main_metric or ""
        return 100.0 if presenter.is_share(metric, self.compared.means) else 1.0

    def settings_table(self) -> Table:
        """Return a table of the settings that differ, by cause."""
        names = ("cause", "setting", "A", "B")
        columns = (*(Column(name, False) for name in names), *map(Column, ("questions", "carries")))
        rows = []
        for finding in self.findings:
            name = finding.cause.name
            n = str(len(finding.questions))
            carries = f"{self._factor * finding.carries:+.2f}"
            for setting in finding.cause.settings:
                values = (_short(setting.first), _short(setting.second))
                rows.append(Row((name, setting.name, *values, n, carries)))
                name = n = carries = ""
            if not finding.cause.settings:
                rows.append(Row((name, "", "", "", n, carries)))
        note = (
            "questions: those that differ and that the cause can explain, and carries what they "
            "carry of the difference of the scores, B less A; several causes may explain one."
        )
        return Table("What differs", columns, tuple(rows), (note,))

    def questions_table(self, *, every: bool = False) -> Table:
        """Return a table of the questions that differ, those that carry most; all if `every`."""
        differing = self.compared.differences
        shown = differing if every else differing[:_N_SHOWN]
        names = ("question", "A", "B")
        numbers = ("character", "token", "margin", "score A", "score B", "carries")
        columns = (*(Column(name, False) for name in names), *map(Column, numbers))
        notes = [
            "character, token: the first that differs; margin: by how many nats the surer run "
            "chose its token before the second."
        ]
        if not any(difference.margin is not None for difference in differing):
            notes.append("Tokens and margins are recorded with --model-args margins=true.")
        if len(shown) < len(differing):
            notes.append(f"{len(differing) - len(shown)} more differ: --all shows them.")
        return Table("Where", columns, tuple(map(self._row, shown)), tuple(notes))

    def _row(self, difference: QuestionDifference) -> Row:
        at = difference.diverges_at
        said = (_said(answer, at) for answer in difference.answers)
        scores = (
            "-" if answer.score is None else f"{self._factor * answer.score:.2f}"
            for answer in difference.answers
        )
        carries = f"{self._factor * difference.carries:+.2f}"
        question = _short(difference.question)
        token, margin = difference.token, difference.margin
        where = (
            "-" if at is None else str(at),
            "-" if token is None else str(token),
            "-" if margin is None else f"{margin:.3f}",
        )
        return Row((question, *said, *where, *scores, carries))


def explain_runs(first: Run, second: Run) -> Explanation:
    """Explain why two runs of one suite differ."""
    if not first.presenter.compares_scorers:
        raise UsageError(
            f"{first.folder} is a run of {first.suite.name}, which has no replies to compare; use "
            "`infthor-eval compare`"
        )
    compared = compare_questions(first, second)
    causes = differing_causes(first.header.config, second.header.config)
    return Explanation((first, second), compared, _find(causes, compared.differences))


def _find(causes: Sequence[Cause], differences: Sequence[QuestionDifference]) -> list[_Finding]:
    findings = {cause.name: _Finding(cause) for cause in causes}
    for difference in differences:
        able = [it for it in causes if it.effects & (difference.effects | difference.possible)]
        unexplained = _unexplained(able, difference.effects)
        for cause in able if unexplained is None else (*able, unexplained):
            finding = findings.setdefault(cause.name, _Finding(cause))
            finding.questions.append(difference)
            finding.n_showing += bool(cause.effects & (difference.effects - {Effect.REPLY}))
    return sorted(findings.values(), key=lambda finding: finding.rank)


def _unexplained(able: Sequence[Cause], effects: frozenset[Effect]) -> Cause | None:
    """Return the cause to name if no setting can explain how a question differs."""
    needed = [effect for effect in _NEEDED if effect in effects]
    if needed:
        is_explained = any(cause.effects & set(needed) for cause in able)
        return None if is_explained else UNEXPLAINED[needed[0]]
    return None if able else UNEXPLAINED[Effect.REPLY]


def _count(n: int, noun: str) -> str:
    plural = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return f"{n} {noun if n == 1 else plural}"


def _said(answer: Answer, at: int | None) -> str:
    """Return an answer around its first character that differs, or its state."""
    if answer.score is None:
        return answer.state
    start = 0 if at is None else max(0, at - 1 - _BEFORE)
    return f"{'…' if start else ''}{_short(answer.text[start:])}"


def _short(text: str) -> str:
    plain = " ".join(text.split())
    return plain if len(plain) <= _LONGEST else f"{plain[: _LONGEST - 1]}…"
