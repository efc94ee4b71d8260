"""The adapter `spatialvla`."""

from tokenizers import Tokenizer

from infthor_eval.errors import ModelError
from model_adapters.hf.loading.checkpoint import wrap_loading_errors
from model_adapters.options.policies import (
    SpatialVLACheckpointOptions,
    SpatialVLAOptions,
    parse_field_of_view,
)
from model_adapters.policies.checkpoint import PolicyCheckpoint
from model_adapters.policies.policy import PolicyAdapter, VlaPolicy
from model_adapters.policies.spatialvla.actions import ProcessorConfig, SpatialBins
from model_adapters.policies.spatialvla.camera import published_intrinsics
from model_adapters.policies.spatialvla.config import SpatialVLAConfig
from model_adapters.policies.spatialvla.network import SpatialVLANetwork, SpatialVLAWeights, View
from model_adapters.policies.statistics import select_statistics
from model_adapters.policies.weights import empty_parameters, load_weights

MODEL_TYPE = "spatialvla"


def load_spatialvla(
    name: str, checkpoint: PolicyCheckpoint, options: SpatialVLAOptions
) -> VlaPolicy:
    """Load a SpatialVLA; see `PolicyAdapter.build`."""
    checkpoint.require_model_type(MODEL_TYPE)
    config = checkpoint.read("config.json", SpatialVLAConfig)
    processor = checkpoint.read("processor_config.json", ProcessorConfig)
    pretrained = checkpoint.pretrained
    key, statistics = select_statistics(processor.statistics, options.unnorm_key, pretrained)
    bins = SpatialBins.of(
        processor, config.action_token_begin_idx, config.spatial_token_num, pretrained
    )
    tokenizer = _tokenizer(checkpoint, config)
    device, dtype = checkpoint.resolve_placement(options)
    with wrap_loading_errors(pretrained):
        config.check(pretrained)
        view = _view(config, processor, key, options, pretrained)
        with empty_parameters():
            weights = SpatialVLAWeights(config, options.attn_implementation)
        load_weights(weights, checkpoint, weights.layout(), device, dtype)
        weights.place_action_embeddings()
    network = SpatialVLANetwork(
        weights.eval(), tokenizer, bins, processor.action_chunk_size, config.image_token_index, view
    )
    identity = checkpoint.identity(device, dtype, options) | {
        "unnorm_key": key,
        "intrinsics": options.intrinsics,
    }
    return VlaPolicy(name, network, statistics, options, identity, options.threads)


def _tokenizer(checkpoint: PolicyCheckpoint, config: SpatialVLAConfig) -> Tokenizer:
    tokenizer = checkpoint.tokenizer()
    first_id = tokenizer.token_to_id("<ACTION00000>")
    if first_id != config.action_token_begin_idx:
        raise ModelError(
            f"{checkpoint.pretrained}: actions begin at {config.action_token_begin_idx} in the "
            f"config and at {first_id} in the tokenizer; restore the checkpoint"
        )
    return tokenizer


def _view(
    config: SpatialVLAConfig,
    processor: ProcessorConfig,
    key: str,
    options: SpatialVLAOptions,
    pretrained: str,
) -> View:
    degrees = parse_field_of_view(options.intrinsics)
    cameras = processor.intrinsic_config
    size, patch, zoe_size = config.sides(pretrained)
    return View(
        image_size=size,
        patch=patch,
        resolution=config.ego3d_patch_reso,
        zoe_size=zoe_size,
        intrinsics=published_intrinsics(cameras, key, size, pretrained)
        if degrees is None
        else None,
        field_of_view=degrees,
    )


class SpatialVLA(PolicyAdapter):
    """The adapter `spatialvla`: IPEC-COMMUNITY/spatialvla-4b-224-pt and similar checkpoints."""

    Options = SpatialVLACheckpointOptions
    load = staticmethod(load_spatialvla)
