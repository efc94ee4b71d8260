"""OpenVLA in vLLM: its prompt, its action tokens and its statistics are those of the native port."""

from typing import Any, ClassVar

import numpy as np
from PIL import Image

from infthor_eval.errors import ModelError
from model_adapters.hf.checkpoint import versions
from model_adapters.policies.checkpoint import find
from model_adapters.policies.openvla.adapter import OpenVLADescription, describe_openvla
from model_adapters.policies.openvla.network import prompt_ids
from model_adapters.policies.policy import VlaPolicy
from model_adapters.policies.statistics import ACTION_SIZE, Actions
from model_adapters.protocols import Capabilities
from model_adapters.vllm.arguments import engine_arguments
from model_adapters.vllm.engine import Engine, EngineRequest, SamplingSettings, import_vllm
from model_adapters.vllm.options import OpenVLAOnVllmOptions, VllmPolicyOptions

__all__ = ["OpenVLAOnVllm", "VllmPolicy"]


class OpenVLAOnVllm:
    """The adapter `openvla@vllm`."""

    Options: ClassVar[type] = OpenVLAOnVllmOptions

    @classmethod
    def build(cls, name: str, options: OpenVLAOnVllmOptions, seed: int) -> "VllmPolicy":  # noqa: ARG003
        """Start vLLM with a checkpoint; nothing in it is random.

        Raises:
            ModelError: vLLM is not there, or the checkpoint cannot be run.
            UsageError: an unknown unnorm_key.
            DataError: a file beside its weights is missing or damaged.
        """
        import_vllm(name)  # told before gigabytes are fetched
        checkpoint = find(options.pretrained, options.revision)
        described = describe_openvla(checkpoint, options.unnorm_key)
        engine = Engine(name, engine_arguments(checkpoint.folder, options) | {"limit_mm_per_prompt": {"image": 1}})
        identity = checkpoint.origin | {
            "engine": "vllm",
            "versions": {**versions(), "vllm": engine.version},
            "dtype": options.dtype,
            "quantization": options.quantization,
            "parallel": [options.tensor_parallel_size, options.pipeline_parallel_size, options.data_parallel_size],
            "enforce_eager": options.enforce_eager,
            "batch_invariant": engine.batch_invariant,
            "unnorm_key": described.key,
        }
        return VllmPolicy(name, _Network(name, engine, described), described, options, identity)


class _Network:
    """The actions that vLLM writes.

    Args:
        name: of the policy, for messages.
        engine: has the weights.
        described: prompt, action tokens and statistics of the checkpoint.
    """

    def __init__(self, name: str, engine: Engine, described: OpenVLADescription) -> None:
        self.engine = engine
        self._name = name
        self._described = described

    def predict(self, image: Image.Image, instruction: str, *, constrained: bool) -> Actions:
        """A chunk of one action; see `Network.predict` of the policies."""
        legal = self._described.bins.legal
        settings: dict[str, Any] = {"max_tokens": ACTION_SIZE, "temperature": 0.0, "ignore_eos": True}
        if constrained:
            settings["allowed_token_ids"] = list(legal)
        request = EngineRequest(prompt_ids(self._described.tokenizer, instruction), [image])
        (written,) = self.engine.generate([request], SamplingSettings(settings=settings))
        if len(written.ids) != ACTION_SIZE:
            raise ModelError(f"{self._name}: vLLM wrote {len(written.ids)} action tokens, not {ACTION_SIZE}; report it")
        return self._described.bins.decode(np.clip(written.ids, legal.start, legal.stop - 1).tolist())


class VllmPolicy(VlaPolicy):
    """A policy whose weights are in vLLM.

    Args:
        name: the registry's name.
        network: asks vLLM.
        described: the checkpoint without weights.
        options: how it is run.
        identity: of checkpoint, dataset and engine, as JSON values.
    """

    def __init__(
        self,
        name: str,
        network: _Network,
        described: OpenVLADescription,
        options: VllmPolicyOptions,
        identity: dict[str, Any],
    ) -> None:
        super().__init__(name, network, described.statistics, options, identity)
        self._engine = network.engine

    @property
    def capabilities(self) -> Capabilities:
        """One request at a time; vLLM does not promise equal actions on equal frames."""
        return Capabilities(counts_tokens=False, token_ids=False, deterministic=False)

    def close(self) -> None:
        """End vLLM."""
        self._engine.close()
