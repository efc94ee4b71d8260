"""Tiny language models."""

from pathlib import Path
from typing import Any

import torch
from transformers import AutoConfig, AutoModelForCausalLM, GenerationConfig

from model_adapters.tiny.tokenizer import train_tokenizer
from model_adapters.tiny.twin import HEAD, text_config

__all__ = ["SETTINGS", "TEMPLATE", "save_language_model"]

# In the form of published language models: contents are strings.
TEMPLATE = """\
{%- for message in messages -%}
{{- '<|im_start|>' + message['content'] + '<|im_end|>' -}}
{%- endfor -%}
{%- if add_generation_prompt %}{{ '<|im_start|>' }}{% endif -%}
"""
SPECIAL = ("<s>", "<|im_start|>", "<|im_end|>", "<pad>")
# The second one's layers attend to windows, the third caps the scores, the fourth and the fifth
# have positions of other kinds, the last two have layers with states instead of keys (Mamba's, and
# linear attention's).
SETTINGS = {
    "llama": {"head_dim": HEAD},
    "qwen2": {"use_sliding_window": True, "sliding_window": 12, "max_window_layers": 1},
    "gemma2": {"head_dim": HEAD, "attn_logit_softcapping": 0.1, "sliding_window": 12},
    "gpt_neox": {},
    "gpt2": {"n_layer": 2, "n_head": 4, "n_embd": 128, "n_positions": 2048},
    "nemotron_h": {
        "layers_block_type": ["linear_attention", "full_attention", "linear_attention", "mlp"],
        "num_hidden_layers": 4,
        "head_dim": HEAD,
        "ssm_state_size": 8,
        "mamba_num_heads": 8,
        "mamba_head_dim": 32,
        "n_groups": 2,
        "chunk_size": 8,
    },
    "qwen3_5_text": {
        "head_dim": HEAD,
        "layer_types": ["linear_attention", "full_attention"],
        **{f"linear_num_{what}_heads": 2 for what in ("key", "value")},
        **{f"linear_{what}_head_dim": 16 for what in ("key", "value")},
    },
}


def save_language_model(folder: Path, model_type: str, **settings: object) -> None:
    """Save a tiny one with random weights, as transformers' `save_pretrained` writes it."""
    tokenizer: Any = train_tokenizer(SPECIAL, end="<|im_end|>", pad="<pad>", begin="<s>", named={})
    tokenizer.chat_template = TEMPLATE
    tokenizer.save_pretrained(folder)
    end, pad, begin = map(tokenizer.convert_tokens_to_ids, ("<|im_end|>", "<pad>", "<s>"))
    text: Any = {"bos_token_id": begin, "max_position_embeddings": 2048, **settings}
    if model_type == "gpt2":
        text |= {"vocab_size": len(tokenizer), "initializer_range": 0.2, "eos_token_id": end}
    else:
        text = text_config(len(tokenizer), end, pad, **text)
    torch.manual_seed(0)
    model = AutoModelForCausalLM.from_config(AutoConfig.for_model(model_type, **text))
    model.generation_config = GenerationConfig(eos_token_id=[end], pad_token_id=pad)
    model.save_pretrained(folder)
