"""The way of lm-eval's requests to a suite of any package.

The functions of a task file make docs, each with the name of its suite under "suite". lm-eval hands
them to our model, which looks up the suite's `RequestAdapter` by that name
(`infthor_eval.suites.find_request_adapter`).
"""

from collections.abc import Hashable, Mapping, Sequence
from typing import Any, Protocol, TypeVar

from infthor_eval.runs import Evaluation, Unit, UnitKey, UnitRecord

Doc = dict[str, Any]
Payload = TypeVar("Payload")  # of the records of a suite
SuiteUnit = TypeVar("SuiteUnit", bound=Unit[Any])


class RequestAdapter(Protocol[SuiteUnit, Payload]):
    """Turns lm-eval's requests into an evaluation, and records into responses."""

    def prepare(
        self, task: str, docs: Sequence[Doc], generation_kwargs: Mapping[str, Any], seed: int
    ) -> Evaluation[SuiteUnit, Payload]:
        """Set up the evaluation of a task's docs (at least one), without other docs' units."""

    def doc_id(self, doc: Doc) -> Hashable:
        """Return the id of a doc, unique among those of its task."""

    def doc_id_of_unit(self, key: UnitKey, cluster: str) -> Hashable:
        """Return the `doc_id` of the doc that a unit belongs to."""

    def response(self, records: Sequence[UnitRecord[Payload]]) -> str:
        """Return the response to a doc, given the records of its units."""
