"""OpenVLA in vLLM, with prompt, action tokens and statistics of the native port."""

from dataclasses import dataclass
from typing import Any, ClassVar

import msgspec
import numpy as np
from PIL import Image

from infthor_eval.errors import ModelError
from model_adapters.hf.loading.checkpoint import versions
from model_adapters.policies.checkpoint import PolicyCheckpoint, find_policy_checkpoint
from model_adapters.policies.openvla.adapter import OpenVLADescription, describe_openvla
from model_adapters.policies.openvla.network import prompt_ids
from model_adapters.policies.policy import VlaPolicy
from model_adapters.policies.statistics import ACTION_SIZE, Actions
from model_adapters.protocols import Capabilities
from model_adapters.vllm.arguments import engine_arguments
from model_adapters.vllm.engine import Engine, EngineRequest, import_vllm
from model_adapters.vllm.options import OpenVLAOnVllmOptions


class OpenVLAOnVllm:
    """The adapter `openvla@vllm`."""

    Options: ClassVar[type] = OpenVLAOnVllmOptions

    @classmethod
    def build(
        cls,
        name: str,
        options: OpenVLAOnVllmOptions,
        seed: int,  # noqa: ARG003
    ) -> "VllmPolicy":
        """Start vLLM with a checkpoint; the seed is not used."""
        import_vllm(name)  # fails before gigabytes are downloaded
        checkpoint = find_policy_checkpoint(options.pretrained, options.revision)
        description = describe_openvla(checkpoint, options.unnorm_key)
        _check_begin_token(name, checkpoint)
        arguments = engine_arguments(checkpoint.folder, options) | {
            "limit_mm_per_prompt": {"image": 1}
        }
        engine = Engine(name, arguments, options.threads)
        identity = checkpoint.origin | {
            "engine": "vllm",
            "versions": {**versions(), "vllm": engine.version},
            "dtype": options.dtype,
            "quantization": options.quantization,
            "parallel": [
                options.tensor_parallel_size,
                options.pipeline_parallel_size,
                options.data_parallel_size,
            ],
            "enforce_eager": options.enforce_eager,
            "batch_invariant": engine.batch_invariant,
            "unnorm_key": description.key,
        }
        network = _VllmNetwork(name, engine, description)
        side = description.config.image_size(options.pretrained)
        crop = side if options.center_crop else None
        return VllmPolicy(name, network, description.statistics, options, identity, crop=crop)


class _TokenizerConfig(msgspec.Struct):
    bos_token: Any = None  # a text, or an object with its settings


def _check_begin_token(name: str, checkpoint: PolicyCheckpoint) -> None:
    """Refuse a checkpoint that does not name the begin token, before which vLLM would put the frame
    without a word.
    """
    file = "tokenizer_config.json"
    if not checkpoint.has_file(file) or not checkpoint.read(file, _TokenizerConfig).bos_token:
        raise ModelError(
            f"{name}: {file} of {checkpoint.pretrained} names no bos_token, which belongs before "
            "the frame; add"
            ' "bos_token": "<s>" to it, or use --engine transformers'
        )


@dataclass(frozen=True)
class _VllmNetwork:
    """A network that lets vLLM decode the action tokens."""

    name: str
    engine: Engine
    description: OpenVLADescription

    def predict(self, image: Image.Image, instruction: str, *, constrained: bool) -> Actions:
        """Return a chunk of one action; see `Network.predict` of the policies."""
        action_ids = self.description.bins.action_ids
        settings: dict[str, Any] = {
            "max_tokens": ACTION_SIZE,
            "temperature": 0.0,
            "ignore_eos": True,
        }
        if constrained:
            settings["allowed_token_ids"] = list(action_ids)
        request = EngineRequest(prompt_ids(self.description.tokenizer, instruction), [image])
        (output,) = self.engine.generate([request], settings)
        if len(output.ids) != ACTION_SIZE:
            raise ModelError(
                f"{self.name}: vLLM wrote {len(output.ids)} action tokens, not {ACTION_SIZE}; "
                "report it"
            )
        return self.description.bins.decode(
            np.clip(output.ids, action_ids.start, action_ids.stop - 1).tolist()
        )


class VllmPolicy(VlaPolicy):
    """A policy whose weights are in vLLM."""

    _network: _VllmNetwork

    @property
    def capabilities(self) -> Capabilities:
        """One request at a time; vLLM does not guarantee equal actions on equal frames."""
        return Capabilities(counts_tokens=False, token_ids=False, deterministic=False)

    def close(self) -> None:
        """Stop vLLM."""
        self._network.engine.close()
