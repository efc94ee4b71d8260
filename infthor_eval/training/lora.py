"""Low-rank adapters (peft) in the decoder, and their way back into the weights."""

from typing import Any

from infthor_eval.errors import UsageError, wrap_errors
from infthor_eval.training.network import SequenceModel
from infthor_eval.training.recipe import Lora

__all__ = ["Adapters", "add_adapters"]


class Adapters:
    """Adapters in a model, until they are merged.

    Args:
        tuner: peft's own object for them.
    """

    def __init__(self, tuner: Any) -> None:
        self._tuner = tuner

    def merge(self) -> None:
        """Add the adapters to the weights and take them out: the model is what it was, with other weights."""
        self._tuner.merge_and_unload()


def add_adapters(network: SequenceModel, settings: Lora) -> Adapters:
    """Put adapters beside the decoder's linear layers, and freeze everything else.

    Args:
        network: the model.
        settings: the recipe's.

    Raises:
        UsageError: peft is not installed, or the decoder has no such layers.
    """
    try:
        import peft
    except ImportError as error:
        raise UsageError("a recipe with lora needs peft; pip install 'infthor-eval[train]'") from error
    within = {id(module) for module in network.decoder.modules()}
    names = [
        name
        for name, module in network.model.named_modules()
        if id(module) in within and name.rpartition(".")[2] in settings.targets
    ]
    config = peft.LoraConfig(
        r=settings.rank, lora_alpha=settings.alpha, lora_dropout=settings.dropout, target_modules=names
    )
    wrong = f"lora.targets {', '.join(settings.targets)}: the decoder has no such layers"
    with wrap_errors(wrong, "name some of its linear layers", catch=ValueError, raise_as=UsageError):
        tuner = peft.LoraModel(network.model, {"default": config}, "default")
    return Adapters(tuner)
