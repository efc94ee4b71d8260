"""Description of a tiny checkpoint, and how it is written."""

import json
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch
from transformers import AutoConfig

from model_adapters.hf.global_settings import hide_transformers_output
from model_adapters.tiny.tokenizer import train_tokenizer
from model_adapters.tiny.twin import HEAD, SPREAD, draw_model, text_config, token_ids
from tiny_families.chats import Chat

__all__ = ["Family", "Vocabulary", "save"]

_VIDEO_FILE = "video_preprocessor_config.json"
# Published files say so; vLLM neither scales nor normalises pixels where they do not.
_PIXELS = {
    **dict.fromkeys(("do_resize", "do_rescale", "do_normalize"), True),
    **{name: [0.5, 0.5, 0.5] for name in ("image_mean", "image_std")},
}
_QUERY_NORMS = ("q_norm.weight", "q_layernorm.weight")
_SHARPER = 4.0


@dataclass(frozen=True)
class Vocabulary:
    """A trained tokenizer's ids.

    Attributes:
        ids: ids of the special tokens by their texts.
        size: number of tokens.
        chat: form of conversations.
    """

    ids: Mapping[str, int]
    size: int
    chat: Chat

    def __getitem__(self, token: str) -> int:
        return self.ids[token]

    def text(self, model_type: str | None = None, **settings: Any) -> dict[str, Any]:
        """Return the config of a language model of two layers for this vocabulary."""
        # transformers writes into what it is given, and families share their settings.
        more = {"head_dim": HEAD, "max_position_embeddings": 32_768, **deepcopy(settings)}
        if model_type is not None:
            more["model_type"] = model_type
        if self.chat.begin is not None:
            more["bos_token_id"] = self.ids[self.chat.begin]
        size = more.pop("vocab_size", self.size)
        return text_config(size, self.ids[self.chat.end], self.ids[self.chat.pad], **more)


@dataclass(frozen=True, kw_only=True)
class Family:
    """Description of a tiny checkpoint of a family, in the form of those that are published.

    Attributes:
        chat: form of conversations.
        image: text of an image in the chat template; `{n}` is its number.
        named: tokens that the processor looks up in the tokenizer, by their names there.
        special: further special tokens, behind those of the chat.
        config: settings of the model's config, from the vocabulary.
        images: content of preprocessor_config.json.
        processor: content of processor_config.json.
        video: content of video_preprocessor_config.json, or None.
    """

    chat: Chat
    image: str
    named: Mapping[str, str] = field(default_factory=dict)
    special: tuple[str, ...] = ()
    config: Callable[[Vocabulary], dict[str, Any]]
    images: Mapping[str, Any]
    processor: Mapping[str, Any]
    video: Mapping[str, Any] | None = None

    def files(self) -> dict[str, Mapping[str, Any]]:
        """Return the processors' files, name to JSON content."""
        images = {**_PIXELS, **self.images}
        files = {"preprocessor_config.json": images, "processor_config.json": self.processor}
        if self.video is not None:
            files[_VIDEO_FILE] = self.video
        return files


def save(model_type: str, family: Family, folder: Path, seed: int = 0) -> None:
    """Write a checkpoint with weights of this seed; the folder is created.

    Processors are written as files, so that none has to be built here: some need torchvision.
    """
    folder.mkdir(parents=True, exist_ok=True)
    chat = family.chat
    special = tuple(dict.fromkeys((*chat.special, *family.named.values(), *family.special)))
    tokenizer = train_tokenizer(
        special, end=chat.end, pad=chat.pad, begin=chat.begin, named=family.named
    )
    tokenizer.chat_template = chat.template(family.image)
    vocabulary = Vocabulary(token_ids(special, tokenizer), len(tokenizer), chat)
    config = AutoConfig.for_model(model_type, **family.config(vocabulary))
    with hide_transformers_output():
        tokenizer.save_pretrained(folder)
        model = draw_model(config, seed, vocabulary[chat.end], vocabulary[chat.pad])
        _enliven(model, seed)
        model.save_pretrained(folder)
    for name, content in family.files().items():
        (folder / name).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


@torch.no_grad()
def _enliven(model: Any, seed: int) -> None:
    """Change weights with which no reply would depend on the frames.

    Those that begin as zeros leave parts without effect (Gemma's projection of frames, the gates of
    Mllama's cross-attention), normalised queries make attention even over a thousand tokens, and
    embeddings that the model multiplies drown everything else.
    """
    draw = torch.Generator().manual_seed(seed)
    for name, weight in model.named_parameters():
        if not weight.any():
            # A gate is a single number.
            weight.normal_(std=1.0 if weight.numel() == 1 else SPREAD, generator=draw)
        if name.endswith(_QUERY_NORMS):
            weight.add_(_SHARPER)
    embeddings = model.get_input_embeddings()
    embeddings.weight.div_(getattr(embeddings, "scalar_embed_scale", 1.0))
