"""Who was evaluated, by whom, and whether the runs say the same."""

import re
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from typing import ClassVar

from infthor_board.case import Case
from infthor_board.reading import Problem, SubmittedRun
from infthor_board.statement import Statement

_ID = re.compile(r"[\w.-]+/[\w.-]+")
_FOLDER = re.compile(r".+-(?P<hash>[0-9a-f]{16})")
_COMMIT = re.compile(r"[0-9a-f]{7,64}")
_TOMORROW = timedelta(days=1)  # somewhere it is the next day already


class CompleteIdentity:
    """The statement has all that a row needs."""

    name: ClassVar[str] = "identity"
    reason: ClassVar[str] = "a row nobody can be asked about, or run again, is worth nothing"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        statement = case.submission.statement
        if statement is None:
            return
        for field in ("revision", "submitted_by", "contact"):
            if not getattr(statement, field).strip():
                yield self._problem(f"submission.yaml has no {field}; fill it")
        if not _ID.fullmatch(statement.model):
            yield self._problem(
                f"model is {statement.model!r:.60}, not DEVELOPER/NAME; write both, as on the hub"
            )
        if statement.date > (datetime.now(UTC) + _TOMORROW).date():
            yield self._problem(f"date is {statement.date}, which is yet to come; correct it")
        for run in case.submission.runs:
            if run.is_export and not statement.engine.strip():
                yield self._problem(
                    f"{run.path.name}: an export does not tell what ran the model; name the engine "
                    "in submission.yaml"
                )
            if not run.is_export and not run.header.config.model.get("name"):
                yield self._problem(f"{run.path.name}: its journal names no model; run it again")

    def _problem(self, text: str) -> Problem:
        return Problem(self.name, text)


class SameModel:
    """The runs are of one model, the one that the statement names."""

    name: ClassVar[str] = "model"
    reason: ClassVar[str] = "the name of one model on the replies of another is the oldest forgery"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        statement = case.submission.statement
        if statement is None:
            return
        runs = [run for run in case.submission.runs if not run.is_export]
        for run in runs:
            for text in _differences(run, statement):
                yield Problem(self.name, f"{run.path.name}: {text}")
        names = sorted({str(run.header.config.model.get("name", "")) for run in runs})
        if len(names) > 1:
            yield Problem(
                self.name, f"its runs are of {', '.join(names)}; send a submission for each model"
            )
        for run in case.submission.runs:
            yield from self._of_export(run, statement)

    def _of_export(self, run: SubmittedRun, statement: Statement) -> Iterator[Problem]:
        for stated in sorted(run.stated_models):
            if stated.rpartition("/")[2] != statement.model.rpartition("/")[2]:
                yield Problem(
                    self.name,
                    f"{run.path.name}: says that it is of {stated!r:.60}, submission.yaml "
                    f"{statement.model!r:.60}; make them say the same",
                )


def _differences(run: SubmittedRun, statement: Statement) -> Iterator[str]:
    """Yield what the journal says otherwise; of a folder or a server it knows no name on the hub,
    and no commit."""
    model = run.header.config.model
    recorded = str(model.get("revision") or "")
    if not recorded:
        return
    checkpoint = str(model.get("checkpoint") or "")
    if checkpoint.lower() != statement.model.lower():
        yield (
            f"the journal is of {checkpoint!r:.60}, submission.yaml says {statement.model!r:.60}; "
            "make them say the same"
        )
    stated = statement.revision.strip().lower()
    is_same = recorded.startswith(stated) or stated.startswith(recorded)
    if _COMMIT.fullmatch(recorded) and not is_same:
        yield (
            f"the journal is of revision {recorded[:12]}, submission.yaml says {stated[:12]}; make "
            "them say the same"
        )


class UneditedConfig:
    """The hash of a run's config is the one in the name of its folder."""

    name: ClassVar[str] = "config"
    reason: ClassVar[str] = "a folder is named by what can change a number: an edit shows"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for run in case.submission.runs:
            named = _FOLDER.fullmatch(run.path.name)
            if run.is_export or named is None or named["hash"] == run.header.config.hash:
                continue
            yield Problem(
                self.name,
                f"{run.path.name}: its journal's config has the hash {run.header.config.hash}; it "
                "was edited, or the folder renamed",
            )
