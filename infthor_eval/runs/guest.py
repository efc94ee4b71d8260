"""Our models under lm-eval's own command line: `lm-eval --model infthor --model_args adapter=qwen2.5-vl-tiny,...`.

lm-eval finds the class through the entry point group `lm_eval.models` from the release on that reads it; until
then, import this module before `lm_eval` builds its model.
"""

import tempfile
from pathlib import Path

import lm_eval.models  # noqa: F401 - before registering, or the built-in models vanish (0.4.13)
from lm_eval.api.registry import register_model

from infthor_eval.errors import UsageError
from infthor_eval.runs.journal import Journal
from infthor_eval.runs.lm import JournaledLM
from model_adapters import Bound, load

__all__ = ["InfthorLM"]


@register_model("infthor")
class InfthorLM(JournaledLM):
    """Any model of ours, by name, for a command line that is not ours."""

    def __init__(
        self,
        adapter: str,
        journal: str | None = None,
        seed: int = 0,
        batch_size: int | str | None = None,
        max_batch_size: int | None = None,
        device: str | None = None,
        **options: object,
    ) -> None:
        """Load a model.

        Args:
            adapter: name of the model (`infthor-eval ls models`).
            journal: file of the journal, to go on where an earlier run stopped; None keeps it for this process only.
            seed: for whatever is random in the model.
            batch_size: lm-eval's; requests are answered one by one.
            max_batch_size: lm-eval's, see `batch_size`.
            device: lm-eval's `--device`, passed on as the model's own option.
            options: the model's options.

        Raises:
            UsageError: an unknown name or option, or a bound, which needs the answer key that lm-eval does not hand on.
            ModelError: the model cannot be loaded.
        """
        given = {key: str(value) for key, value in options.items()} | ({"device": device} if device else {})
        model = load(adapter, given, seed)
        if isinstance(model, Bound):
            raise UsageError(f"{adapter} reads the answer key; run it with infthor-eval --model {adapter}")
        self._scratch = tempfile.TemporaryDirectory() if journal is None else None
        path = Path(journal) if journal else Path(str(self._scratch and self._scratch.name)) / "journal.jsonl"
        super().__init__(model, Journal(path, {"model": {"name": model.name, **model.identity()}, "seed": seed}))
