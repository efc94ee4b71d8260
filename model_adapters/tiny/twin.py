"""How a tiny twin of a model family is made: the real classes, random weights, a tokenizer trained on the spot."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, cast

import torch
from transformers import AutoModelForImageTextToText, GenerationConfig, PreTrainedTokenizerBase

from model_adapters.hf.checkpoint import assemble, resolve_device, resolve_dtype
from model_adapters.hf.family import MakeFamily
from model_adapters.hf.model import TransformersModel
from model_adapters.hf.rope import apply_rope
from model_adapters.hf.templates import plain_template
from model_adapters.options.tiny import TinyOptions
from model_adapters.tiny.tokenizer import train_tokenizer

__all__ = ["SPREAD", "TinyAdapter", "Twin"]

# Standard deviation of the weights. Ten times the usual one, so that replies of a model without training differ from
# frame to frame and from question to question.
SPREAD = 0.2


@dataclass(frozen=True, kw_only=True)
class Twin:
    """What makes a tiny model one of its family.

    Attributes:
        special: special tokens; their ids follow the trained ones.
        end: the token that ends a turn.
        pad: the padding token.
        begin: the token that begins every text, if there is one.
        image: the image token.
        template: chat template that writes what the family's writes.
        config: makes the model's config from the ids of the special tokens and the vocabulary size.
        image_processor: class of the image processor.
        image_settings: its settings where they differ from the class's.
        family: the family.
        files: further files of a saved checkpoint, name to JSON content: what the full processor, which cannot be built
            without torchvision, would write.
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
        """The tokenizer, trained anew."""
        return train_tokenizer(
            self.special, end=self.end, pad=self.pad, begin=self.begin, named={"image_token": self.image}
        )

    def model_config(self, tokenizer: PreTrainedTokenizerBase) -> Any:
        """The config for a tokenizer."""
        return self.config(_ids(self.special, tokenizer), len(tokenizer))

    def model(self, tokenizer: PreTrainedTokenizerBase, config: Any, seed: int, attn_implementation: str) -> Any:
        """The model with random weights of this seed, in float32 on the CPU."""
        ids = _ids(self.special, tokenizer)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            model = cast(Any, AutoModelForImageTextToText).from_config(
                config, attn_implementation=attn_implementation, dtype=torch.float32
            )
        ends = list(dict.fromkeys([ids[self.end], ids[self.pad]]))
        model.generation_config = GenerationConfig(eos_token_id=ends, pad_token_id=ids[self.pad])
        return model

    def save(self, folder: Path, seed: int) -> None:
        """Write a checkpoint that the family's adapter and transformers' auto classes load.

        Args:
            folder: made if it does not exist.
            seed: of the weights.
        """
        folder.mkdir(parents=True, exist_ok=True)
        tokenizer = self.tokenizer()
        tokenizer.chat_template = self.template
        tokenizer.save_pretrained(folder)
        self.model(tokenizer, self.model_config(tokenizer), seed, "sdpa").save_pretrained(folder)
        self.image_processor(**self.image_settings).save_pretrained(folder)
        for name, content in self.files.items():
            (folder / name).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def _ids(tokens: Sequence[str], tokenizer: PreTrainedTokenizerBase) -> dict[str, int]:
    return {token: cast(int, tokenizer.convert_tokens_to_ids(token)) for token in tokens}


class TinyAdapter:
    """Base of the adapters of tiny models.

    Attributes:
        twin: what the model is made from.
    """

    Options: ClassVar[type] = TinyOptions
    twin: ClassVar[Twin]

    @classmethod
    def build(cls, name: str, options: TinyOptions, seed: int) -> TransformersModel:
        """Make a model with random weights of this seed."""
        twin = cls.twin
        tokenizer = twin.tokenizer()
        dtype = resolve_dtype(options)
        config = twin.model_config(tokenizer)
        max_tokens = apply_rope(config, options.rope)
        model = twin.model(tokenizer, config, seed, options.attn_implementation)
        model = model.to(resolve_device(options), torch.float32 if isinstance(dtype, str) else dtype)
        image_processor = twin.image_processor(**{**twin.image_settings, **options.image_settings()})
        family = twin.family(model, image_processor, tokenizer)
        loaded = assemble(
            model,
            tokenizer,
            image_processor,
            template=twin.template if options.prompt == "chat" else plain_template(tokenizer, family),
            family=family,
            max_tokens=max_tokens,
            origin={"checkpoint": name, "seed": seed},
        )
        return TransformersModel(name, loaded, options)
