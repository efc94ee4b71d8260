"""The adapter `openvla`."""

from dataclasses import dataclass
from typing import Any, ClassVar

from tokenizers import Tokenizer

from infthor_eval.errors import ModelError
from model_adapters.hf.checkpoint import loading
from model_adapters.options.policies import OpenVLAOptions, PolicyOptions
from model_adapters.policies.checkpoint import PolicyCheckpoint, find
from model_adapters.policies.openvla.actions import ActionBins
from model_adapters.policies.openvla.config import OpenVLAConfig
from model_adapters.policies.openvla.network import OpenVLANetwork, OpenVLAWeights, layout_of
from model_adapters.policies.policy import VlaPolicy
from model_adapters.policies.statistics import ActionStatistics, statistics_of
from model_adapters.policies.weights import empty, load_weights

__all__ = ["MODEL_TYPE", "OpenVLA", "OpenVLADescription", "describe_openvla", "load_openvla"]

MODEL_TYPE = "openvla"
_FINE_TUNED = "dataset_statistics.json"


class OpenVLA:
    """The adapter `openvla`: openvla/openvla-7b and what was fine-tuned from it."""

    Options: ClassVar[type] = OpenVLAOptions

    @classmethod
    def build(cls, name: str, options: OpenVLAOptions, seed: int) -> VlaPolicy:  # noqa: ARG003
        """Load a checkpoint; nothing in it is random.

        Raises:
            ModelError: it cannot be loaded, or is another family's.
            UsageError: an unknown unnorm_key, device or dtype.
            DataError: a file beside its weights is missing or damaged.
        """
        return load_openvla(name, find(options.pretrained, options.revision), options)


@dataclass(frozen=True)
class OpenVLADescription:
    """All of a checkpoint but its weights.

    Attributes:
        config: its config.
        key: the dataset whose statistics are used.
        statistics: of that dataset's actions.
        tokenizer: of the language model; it begins every text with `<s>`.
        bins: what action ids mean.
    """

    config: OpenVLAConfig
    key: str
    statistics: ActionStatistics
    tokenizer: Tokenizer
    bins: ActionBins


def describe_openvla(checkpoint: PolicyCheckpoint, unnorm_key: str | None) -> OpenVLADescription:
    """Read what stands beside the weights of an OpenVLA.

    Args:
        checkpoint: where it lies.
        unnorm_key: the dataset whose statistics are used; None where there is only one.

    Raises:
        ModelError: it is another family's checkpoint, or damaged.
        UsageError: an unknown unnorm_key.
        DataError: a file is missing or damaged.
    """
    checkpoint.require_kind(MODEL_TYPE)
    config = checkpoint.read("config.json", OpenVLAConfig)
    key, statistics = statistics_of(_statistics(checkpoint, config), unnorm_key, checkpoint.pretrained)
    with loading(checkpoint.pretrained):
        vocabulary = config.language("eager").vocab_size - config.pad_to_multiple_of
    bins = ActionBins(vocabulary, config.n_action_bins)
    return OpenVLADescription(config, key, statistics, _tokenizer(checkpoint), bins)


def load_openvla(name: str, checkpoint: PolicyCheckpoint, options: PolicyOptions) -> VlaPolicy:
    """Load an OpenVLA from a folder.

    Args:
        name: the registry's name.
        checkpoint: where it lies.
        options: how it is run.

    Raises:
        ModelError: see `OpenVLA.build`.
    """
    described = describe_openvla(checkpoint, options.unnorm_key)
    config = described.config
    device, dtype = checkpoint.placed(options)
    towers, size = config.towers(checkpoint.pretrained), config.image_size(checkpoint.pretrained)
    with loading(checkpoint.pretrained):
        with empty():
            weights = OpenVLAWeights(towers, size, config.language(options.attn_implementation))
        layout = layout_of(weights, towers)
        load_weights(weights, checkpoint.folder, layout, pretrained=checkpoint.pretrained, device=device, dtype=dtype)
    network = OpenVLANetwork(weights.eval(), described.tokenizer, described.bins, size)
    identity = checkpoint.identity(device, dtype, options) | {"unnorm_key": described.key}
    return VlaPolicy(name, network, described.statistics, options, identity)


def _tokenizer(checkpoint: PolicyCheckpoint) -> Tokenizer:
    tokenizer = checkpoint.tokenizer()
    # The patches go in behind the first token, whatever that is.
    if tokenizer.encode("In").ids[0] != tokenizer.token_to_id("<s>"):
        raise ModelError(f"{checkpoint.pretrained}: the tokenizer does not begin a text with <s>; restore its file")
    return tokenizer


def _statistics(checkpoint: PolicyCheckpoint, config: OpenVLAConfig) -> dict[str, Any]:
    """Statistics by dataset: OpenVLA's fine-tuning leaves those of the new data in a file of their own."""
    return checkpoint.read(_FINE_TUNED, dict[str, Any]) if checkpoint.has(_FINE_TUNED) else config.norm_stats
