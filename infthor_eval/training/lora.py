"""Low-rank adapters (peft) in the decoder."""

from typing import Any

from infthor_eval.errors import UsageError, wrap_errors
from infthor_eval.training.network import SequenceModel
from infthor_eval.training.recipe import Lora

__all__ = ["Adapters", "add_adapters"]


class Adapters:
    """Adapters in a model.

    Args:
        tuner: peft's object for them.
    """

    def __init__(self, tuner: Any) -> None:
        self._tuner = tuner

    def merge(self) -> None:
        """Add the adapters to the weights and remove them from the model."""
        self._tuner.merge_and_unload()


def add_adapters(network: SequenceModel, settings: Lora) -> Adapters:
    """Add adapters to the decoder's linear layers, and freeze everything else.

    Args:
        network: the model.
        settings: settings of the adapters.

    Raises:
        UsageError: peft is not installed, or the decoder has none of the target layers.
    """
    try:
        import peft
    except ImportError as error:
        raise UsageError("a recipe with lora needs peft; pip install 'infthor-eval[train]'") from error
    in_decoder = {id(module) for module in network.decoder.modules()}
    names = [
        name
        for name, module in network.model.named_modules()
        if id(module) in in_decoder and name.rpartition(".")[2] in settings.targets
    ]
    config = peft.LoraConfig(
        r=settings.rank, lora_alpha=settings.alpha, lora_dropout=settings.dropout, target_modules=names
    )
    problem = f"lora.targets {', '.join(settings.targets)}: the decoder has no such layers"
    with wrap_errors(problem, "name some of its linear layers", catch=ValueError, raise_as=UsageError):
        tuner = peft.LoraModel(network.model, {"default": config}, "default")
    return Adapters(tuner)
