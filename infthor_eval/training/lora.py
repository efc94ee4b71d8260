"""Low-rank adapters (peft) in the decoder."""

from typing import Any

from infthor_eval.errors import UsageError, wrap_errors
from infthor_eval.training.network import SequenceModel
from infthor_eval.training.recipe import Lora


def add_adapters(network: SequenceModel, settings: Lora) -> Any:
    """Add adapters to the decoder's linear layers, freeze the rest, and return peft's model.

    Raises:
        UsageError: peft is not installed, or the decoder has none of the target layers.
    """
    try:
        import peft
    except ImportError as error:
        raise UsageError(
            "a recipe with lora needs peft; pip install 'infthor-eval[train]'"
        ) from error
    in_decoder = {id(module) for module in network.decoder.modules()}
    names = [
        name
        for name, module in network.model.named_modules()
        if id(module) in in_decoder and name.rpartition(".")[2] in settings.targets
    ]
    config = peft.LoraConfig(
        r=settings.rank,
        lora_alpha=settings.alpha,
        lora_dropout=settings.dropout,
        target_modules=names,
    )
    problem = f"lora.targets {', '.join(settings.targets)}: the decoder has no such layers"
    with wrap_errors(
        problem, "name some of its linear layers", catch=ValueError, raise_as=UsageError
    ):
        return peft.LoraModel(network.model, {"default": config}, "default")
