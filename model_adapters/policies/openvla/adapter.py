"""The adapter `openvla`."""

from dataclasses import dataclass
from typing import Any

from tokenizers import Tokenizer

from infthor_eval.errors import ModelError
from model_adapters.hf.loading.checkpoint import wrap_loading_errors
from model_adapters.options.policies import OpenVLAOptions, OpenVLATinyOptions
from model_adapters.policies.checkpoint import PolicyCheckpoint
from model_adapters.policies.openvla.actions import ActionBins
from model_adapters.policies.openvla.config import OpenVLAConfig
from model_adapters.policies.openvla.network import OpenVLANetwork, OpenVLAWeights, weights_layout
from model_adapters.policies.policy import PolicyAdapter, VlaPolicy
from model_adapters.policies.statistics import ActionStatistics, select_statistics
from model_adapters.policies.weights import empty_parameters, load_weights

MODEL_TYPE = "openvla"
_FINE_TUNED = "dataset_statistics.json"


@dataclass(frozen=True)
class OpenVLADescription:
    """Everything in a checkpoint except its weights.

    Attributes:
        config: config of the checkpoint.
        key: dataset whose statistics are used.
        statistics: statistics of the dataset's actions.
        tokenizer: tokenizer of the language model, which begins every text with `<s>`.
        bins: conversion of action ids.
    """

    config: OpenVLAConfig
    key: str
    statistics: ActionStatistics
    tokenizer: Tokenizer
    bins: ActionBins


def describe_openvla(checkpoint: PolicyCheckpoint, unnorm_key: str | None) -> OpenVLADescription:
    """Read the files beside OpenVLA's weights; without an unnorm_key, they must be of one
    dataset."""
    checkpoint.require_model_type(MODEL_TYPE)
    config = checkpoint.read("config.json", OpenVLAConfig)
    # OpenVLA's fine-tuning writes the statistics of new data to a separate file.
    is_fine_tuned = checkpoint.has_file(_FINE_TUNED)
    known = checkpoint.read(_FINE_TUNED, dict[str, Any]) if is_fine_tuned else config.norm_stats
    key, statistics = select_statistics(known, unnorm_key, checkpoint.pretrained)
    with wrap_loading_errors(checkpoint.pretrained):
        vocabulary = config.language("eager").vocab_size - config.pad_to_multiple_of
    bins = ActionBins(vocabulary, config.n_action_bins)
    return OpenVLADescription(config, key, statistics, _tokenizer(checkpoint), bins)


def load_openvla(
    name: str, checkpoint: PolicyCheckpoint, options: OpenVLAOptions | OpenVLATinyOptions
) -> VlaPolicy:
    """Load an OpenVLA; see `PolicyAdapter.build`."""
    description = describe_openvla(checkpoint, options.unnorm_key)
    config = description.config
    device, dtype = checkpoint.resolve_placement(options)
    towers = config.towers(checkpoint.pretrained)
    size = config.image_size(checkpoint.pretrained)
    with wrap_loading_errors(checkpoint.pretrained):
        with empty_parameters():
            weights = OpenVLAWeights(towers, size, config.language(options.attn_implementation))
        layout = weights_layout(weights, towers)
        load_weights(weights, checkpoint, layout, device, dtype)
    network = OpenVLANetwork(weights.eval(), description.tokenizer, description.bins, size)
    identity = checkpoint.identity(device, dtype, options) | {"unnorm_key": description.key}
    crop = size if options.center_crop else None
    return VlaPolicy(
        name, network, description.statistics, options, identity, options.threads, crop
    )


def _tokenizer(checkpoint: PolicyCheckpoint) -> Tokenizer:
    tokenizer = checkpoint.tokenizer()
    # The network inserts the patches after the first token, so this has to be the begin token.
    if tokenizer.encode("In").ids[0] != tokenizer.token_to_id("<s>"):
        raise ModelError(
            f"{checkpoint.pretrained}: the tokenizer does not begin a text with <s>; restore its "
            "file"
        )
    return tokenizer


class OpenVLA(PolicyAdapter):
    """The adapter `openvla`: openvla/openvla-7b and checkpoints fine-tuned from it."""

    Options = OpenVLAOptions
    load = staticmethod(load_openvla)
