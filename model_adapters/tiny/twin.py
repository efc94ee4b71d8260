"""Tiny twins of model families: real classes, random weights, a tokenizer trained on the spot."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, cast

import torch
from transformers import AutoModelForImageTextToText, GenerationConfig, PreTrainedTokenizerBase

from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.family import MakeFamily
from model_adapters.hf.global_settings import hide_transformers_output
from model_adapters.hf.loading.checkpoint import assemble, resolve_device, resolve_dtype
from model_adapters.hf.loading.rope import apply_rope
from model_adapters.hf.loading.tower_names import with_published_names
from model_adapters.hf.prompting.templates import plain_template
from model_adapters.options.checkpoints import HfOptions
from model_adapters.tiny.tokenizer import train_tokenizer

# Standard deviation of the weights. Ten times the usual one, so that replies of an untrained model
# differ from frame to frame and from question to question.
SPREAD = 0.2
# Sizes of the language models. vLLM's attention on a CPU takes no heads below 32.
HEAD = 32
HIDDEN = 4 * HEAD


@dataclass(frozen=True, kw_only=True)
class Twin:
    """Description of a tiny model of a family.

    Attributes:
        special: special tokens; their ids follow those of the trained tokens.
        end: token that ends a turn.
        pad: padding token.
        begin: token that begins every text, or None.
        image: image token.
        template: chat template with the same output as the family's.
        config: builds the model's config from the ids of the special tokens and the vocabulary
            size.
        image_processor: class of the image processor.
        image_settings: settings of the image processor that differ from the defaults of its class.
        family: builds the family of the model.
        files: further files of a saved checkpoint, name to JSON content; the full processor, which
            cannot be built without torchvision, would write them.
    """

    special: tuple[str, ...]
    end: str
    pad: str
    image: str
    begin: str | None = None
    template: str
    config: Callable[[Mapping[str, int], int], Any]
    image_processor: Callable[..., Any]
    image_settings: Mapping[str, Any] = field(default_factory=dict)
    family: MakeFamily
    files: Mapping[str, Mapping[str, Any]]

    def tokenizer(self) -> PreTrainedTokenizerBase:
        """Train the tokenizer."""
        return train_tokenizer(
            self.special,
            end=self.end,
            pad=self.pad,
            begin=self.begin,
            named={"image_token": self.image},
        )

    def model_config(self, tokenizer: PreTrainedTokenizerBase) -> Any:
        """Return the model's config for a tokenizer."""
        return self.config(token_ids(self.special, tokenizer), len(tokenizer))

    def model(
        self, tokenizer: PreTrainedTokenizerBase, config: Any, seed: int, attn_implementation: str
    ) -> Any:
        """Return the model with random weights of this seed, in float32 on the CPU."""
        ids = token_ids((self.end, self.pad), tokenizer)
        return draw_model(config, seed, ids[self.end], ids[self.pad], attn_implementation)

    def save(self, folder: Path, seed: int) -> None:
        """Write a checkpoint that the family's adapter and transformers' auto classes load, with
        weights of this seed.

        The folder is created.
        """
        folder.mkdir(parents=True, exist_ok=True)
        tokenizer = self.tokenizer()
        tokenizer.chat_template = self.template
        with hide_transformers_output():
            tokenizer.save_pretrained(folder)
            model = self.model(tokenizer, self.model_config(tokenizer), seed, "sdpa")
            model.save_pretrained(folder, state_dict=with_published_names(model.state_dict()))
            self.image_processor(**self.image_settings).save_pretrained(folder)
        for name, content in self.files.items():
            (folder / name).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def token_ids(tokens: Sequence[str], tokenizer: PreTrainedTokenizerBase) -> dict[str, int]:
    """Return the ids of tokens by their texts."""
    return {token: cast(int, tokenizer.convert_tokens_to_ids(token)) for token in tokens}


def draw_model(
    config: Any, seed: int, end_id: int, pad_id: int, attn_implementation: str = "sdpa"
) -> Any:
    """Return a transformers model with random weights, in float32 on the CPU.

    Args:
        config: config of the model.
        seed: seed of the weights; torch's global generator is left as it was.
        end_id: token that ends a turn.
        pad_id: padding token, which also ends a turn.
        attn_implementation: transformers' name of the attention kernel.
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        model = cast(Any, AutoModelForImageTextToText).from_config(
            config, attn_implementation=attn_implementation, dtype=torch.float32
        )
    model.generation_config = GenerationConfig(
        eos_token_id=list(dict.fromkeys([end_id, pad_id])), pad_token_id=pad_id
    )
    return model


def text_config(vocab_size: int, end_id: int, pad_id: int, **settings: Any) -> dict[str, Any]:
    """Return the config of a tiny language model of two layers; settings add to the usual ones or
    replace them."""
    return {
        "vocab_size": vocab_size,
        "hidden_size": HIDDEN,
        "intermediate_size": 128,
        "num_hidden_layers": 2,
        "num_attention_heads": HIDDEN // HEAD,
        "num_key_value_heads": 2,
        "initializer_range": SPREAD,
        "bos_token_id": None,
        "eos_token_id": end_id,
        "pad_token_id": pad_id,
        **settings,
    }


def siglip_config(patch_size: int) -> dict[str, Any]:
    """Return the config of a tiny SigLIP tower of one layer for images of 384 x 384 pixels."""
    return {
        "model_type": "siglip_vision_model",
        "image_size": 384,
        "patch_size": patch_size,
        "hidden_size": 16,
        "intermediate_size": 32,
        "num_hidden_layers": 1,
        "num_attention_heads": 1,
        "vision_use_head": False,
    }


class TinyAdapter:
    """Base of the adapters of tiny models."""

    Options: ClassVar[type] = HfOptions
    twin: ClassVar[Twin]

    @classmethod
    def build(cls, name: str, options: HfOptions, seed: int) -> TransformersModel:
        """Build a model with random weights of this seed."""
        twin = cls.twin
        tokenizer = twin.tokenizer()
        dtype = resolve_dtype(options)
        config = twin.model_config(tokenizer)
        max_tokens = apply_rope(config, options.rope)
        model = twin.model(tokenizer, config, seed, options.attn_implementation)
        model = model.to(
            resolve_device(options), torch.float32 if isinstance(dtype, str) else dtype
        )
        image_processor = twin.image_processor(
            **{**twin.image_settings, **options.image_settings()}
        )
        family = twin.family(model, image_processor, tokenizer)
        loaded = assemble(
            model,
            tokenizer,
            image_processor,
            template=twin.template
            if options.prompt == "chat"
            else plain_template(tokenizer, family),
            family=family,
            max_tokens=max_tokens,
            origin={"checkpoint": name, "seed": seed},
        )
        return TransformersModel(name, loaded, options)
