"""The adapter `spatialvla`."""

from typing import ClassVar

from tokenizers import Tokenizer

from infthor_eval.errors import ModelError
from model_adapters.hf.checkpoint import loading
from model_adapters.options.policies import SpatialVLACheckpointOptions, SpatialVLAOptions, parse_field_of_view
from model_adapters.policies.checkpoint import PolicyCheckpoint, find
from model_adapters.policies.policy import VlaPolicy
from model_adapters.policies.spatialvla.actions import ProcessorConfig, SpatialBins
from model_adapters.policies.spatialvla.camera import published_intrinsics
from model_adapters.policies.spatialvla.config import SpatialVLAConfig
from model_adapters.policies.spatialvla.network import SpatialVLANetwork, SpatialVLAWeights, View
from model_adapters.policies.statistics import statistics_of
from model_adapters.policies.weights import empty, load_weights

__all__ = ["MODEL_TYPE", "SpatialVLA", "load_spatialvla"]

MODEL_TYPE = "spatialvla"


class SpatialVLA:
    """The adapter `spatialvla`: IPEC-COMMUNITY/spatialvla-4b-224-pt and its relatives."""

    Options: ClassVar[type] = SpatialVLACheckpointOptions

    @classmethod
    def build(cls, name: str, options: SpatialVLACheckpointOptions, seed: int) -> VlaPolicy:  # noqa: ARG003
        """Load a checkpoint; nothing in it is random.

        Raises:
            ModelError: it cannot be loaded, or is another family's.
            UsageError: an unknown unnorm_key, device or dtype.
            DataError: a file beside its weights is missing or damaged.
        """
        return load_spatialvla(name, find(options.pretrained, options.revision), options)


def load_spatialvla(name: str, checkpoint: PolicyCheckpoint, options: SpatialVLAOptions) -> VlaPolicy:
    """Load a SpatialVLA from a folder.

    Args:
        name: the registry's name.
        checkpoint: where it lies.
        options: how it is run.

    Raises:
        ModelError: see `SpatialVLA.build`.
    """
    checkpoint.require_kind(MODEL_TYPE)
    config = checkpoint.read("config.json", SpatialVLAConfig)
    processor = checkpoint.read("processor_config.json", ProcessorConfig)
    pretrained = checkpoint.pretrained
    key, statistics = statistics_of(processor.statistics, options.unnorm_key, pretrained)
    bins = SpatialBins.of(processor, config.action_token_begin_idx, config.spatial_token_num, pretrained)
    tokenizer = _tokenizer(checkpoint, config)
    device, dtype = checkpoint.placed(options)
    with loading(pretrained):
        config.check(pretrained)
        view = _view(config, processor, key, options, pretrained)
        with empty():
            weights = SpatialVLAWeights(config, options.attn_implementation)
        load_weights(weights, checkpoint.folder, weights.layout(), pretrained=pretrained, device=device, dtype=dtype)
        weights.finish()
    network = SpatialVLANetwork(
        weights.eval(), tokenizer, bins, processor.action_chunk_size, config.image_token_index, view
    )
    identity = checkpoint.identity(device, dtype, options) | {
        "unnorm_key": key,
        "intrinsics": options.intrinsics,
    }
    return VlaPolicy(name, network, statistics, options, identity)


def _tokenizer(checkpoint: PolicyCheckpoint, config: SpatialVLAConfig) -> Tokenizer:
    tokenizer = checkpoint.tokenizer()
    found = tokenizer.token_to_id("<ACTION00000>")
    if found != config.action_token_begin_idx:
        raise ModelError(
            f"{checkpoint.pretrained}: actions begin at {config.action_token_begin_idx} in the config and at {found} "
            "in the tokenizer; restore the checkpoint"
        )
    return tokenizer


def _view(
    config: SpatialVLAConfig, processor: ProcessorConfig, key: str, options: SpatialVLAOptions, pretrained: str
) -> View:
    degrees, cameras = parse_field_of_view(options.intrinsics), processor.intrinsic_config
    size, patch, zoe_size = config.sides(pretrained)
    return View(
        image_size=size,
        patch=patch,
        resolution=config.ego3d_patch_reso,
        zoe_size=zoe_size,
        intrinsics=published_intrinsics(cameras, key, size, pretrained) if degrees is None else None,
        field_of_view=degrees,
    )
