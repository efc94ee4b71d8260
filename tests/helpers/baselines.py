"""Baselines for the tests of commands that run them."""

from collections.abc import Callable
from typing import Any

from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import QuestionVariant
from model_adapters import Capabilities

__all__ = ["ScriptedBaseline"]


class ScriptedBaseline:
    """A baseline that replies to a question what a function says."""

    capabilities = Capabilities(counts_tokens=False, token_ids=False)

    def __init__(self, name: str, reply: Callable[[Question], str]) -> None:
        self.name, self._reply = name, reply

    def identity(self) -> dict[str, Any]:
        """See `Baseline`."""
        return {}

    def close(self) -> None:
        """Nothing is held."""

    def fit(self, _data: Any, _context: str) -> Callable[..., str]:
        """See `Baseline`."""
        return self._answer

    def _answer(self, sample: QuestionVariant, _shown: object = ()) -> str:
        return self._reply(sample.question)
