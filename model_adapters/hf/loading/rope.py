"""Longer contexts by scaled rotary positions (RoPE), in the form of transformers 5.

transformers recomputes the frequencies of `dynamic` and `longrope` inside the forward pass, from
the largest position so far. In a chunked prefill or with a cached prefix, earlier and later tokens
would then have different frequencies. Here they are set once per request from the prompt's full
length, as a single pass over the whole prompt would.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from transformers.modeling_rope_utils import ROPE_INIT_FUNCTIONS

from infthor_eval.errors import ModelError
from model_adapters.options.checkpoints import parse_rope

_FIXED = "fixed"  # a rope_type whose frequencies transformers does not recompute
# transformers scales attention by this factor, whatever the length; 1 leaves it as it is.
_PUBLISHED_LONGROPE_FACTOR = 1.0


def apply_rope(config: Any, rope: str | None) -> int | None:
    """Write a context extension into a model's config.

    The original length is the config's `max_position_embeddings`, as in the published evaluation.
    `longrope` is the published form: all frequencies are divided by the factor for prompts that are
    longer than the original length, and shorter ones are as without an extension. `longrope-scaled`
    is that of LongRoPE's authors: the checkpoint's own factors of frequencies where it has them,
    and attention scaled at every length.

    Args:
        config: config of the model; its text config is changed.
        rope: `TYPE:FACTOR`, or None for the checkpoint's own.

    Returns:
        The context limit in tokens, or None if the config has none.
    """
    text = config.get_text_config()
    limit: int | None = getattr(text, "max_position_embeddings", None)
    if rope is None:
        return limit
    rope_type, factor = parse_rope(rope)
    parameters = getattr(text, "rope_parameters", None)
    if limit is None or not isinstance(parameters, dict) or "rope_theta" not in parameters:
        raise ModelError(
            f"rope={rope}: a {config.model_type} model has no single RoPE with a length to extend"
        )
    kept = {
        name: parameters[name]
        for name in ("mrope_section", "partial_rotary_factor")
        if name in parameters
    }
    new: dict[str, Any] = {
        "rope_type": rope_type,
        "rope_theta": parameters["rope_theta"],
        "factor": factor,
        **kept,
    }
    if rope_type not in ("dynamic", "linear"):
        new["original_max_position_embeddings"] = limit
    if rope_type in ("longrope", "longrope-scaled"):
        new |= _longrope_parameters(text, rope_type == "longrope-scaled", factor)
    text.rope_parameters = new
    return int(limit * factor)


def _longrope_parameters(text: Any, is_scaled: bool, factor: float) -> dict[str, Any]:
    parameters = text.rope_parameters
    head = getattr(text, "head_dim", None) or text.hidden_size // text.num_attention_heads
    n_frequencies = int(head * parameters.get("partial_rotary_factor", 1.0)) // 2
    own = parameters if is_scaled else {}
    return {
        "rope_type": "longrope",
        "short_factor": own.get("short_factor", [1.0] * n_frequencies),
        "long_factor": own.get("long_factor", [factor] * n_frequencies),
        "factor": factor if is_scaled else _PUBLISHED_LONGROPE_FACTOR,
    }


@dataclass(frozen=True)
class LengthRope:
    """Rotary embeddings whose frequencies depend on the length of the prompt.

    Attributes:
        modules: rotary embeddings of the model.
        compute: transformers' function for the frequencies.
        original: length up to which the original frequencies apply, in positions.
        by_length: true if each greater length has its own frequencies (dynamic), false if all share
            some (longrope).
    """

    modules: tuple[Any, ...]
    compute: Callable[..., tuple[Any, float]]
    original: int
    by_length: bool

    def key(self, n_positions: int) -> int:
        """Return a key that is equal for lengths with equal frequencies."""
        longer = max(n_positions - self.original, 0)
        return longer if self.by_length else int(longer > 0)

    def set(self, n_positions: int) -> None:
        """Set the frequencies for a prompt of this many positions."""
        for module in self.modules:
            device = module.inv_freq.device
            module.inv_freq, module.attention_scaling = self.compute(
                module.config, device, seq_len=n_positions
            )


def take_length_rope(model: Any) -> LengthRope | None:
    """Take control of a model's rotary embeddings if their frequencies depend on the length; else
    return None."""
    modules = tuple(
        module
        for module in model.modules()
        if isinstance(getattr(module, "rope_type", None), str)
        and re.search("dynamic|longrope", module.rope_type)
    )
    if not modules:
        return None
    first = modules[0]
    rope_type = first.rope_type
    parameters = first.config.rope_parameters
    original = parameters.get(
        "original_max_position_embeddings", first.config.max_position_embeddings
    )
    for module in modules:
        module.rope_type = _FIXED
    return LengthRope(
        modules, ROPE_INIT_FUNCTIONS[rope_type], original, by_length="dynamic" in rope_type
    )
