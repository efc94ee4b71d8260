"""Published checkpoints whose configs are kept here, so that they can be rehearsed without network.

To add a checkpoint that can be rehearsed without its files: a paragraph in
`model_adapters/hf/rehearsal/checkpoints.yaml`, with a source to compare it with.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from tokenizers import Tokenizer, models
from transformers import PreTrainedTokenizerFast

from infthor_eval.formats.yaml_files import read_yaml

_TABLE = Path(__file__).with_name("checkpoints.yaml")
_UNKNOWN = "<unk>"


@dataclass(frozen=True)
class KnownCheckpoint:
    """The config of a published checkpoint, without its weights and its vocabulary.

    Attributes:
        source: where the config is from.
        config: content of config.json, as far as shapes depend on it.
        images: content of preprocessor_config.json.
        tokens: ids of the special tokens that stand for frames, by their texts.
        processor: content of processor_config.json; empty for families with code of their own.
        named: tokens that the processor looks up in the tokenizer, by their names there.
        parameters: the published number of parameters, or None where none was found.
    """

    source: str
    config: Mapping[str, Any]
    images: Mapping[str, Any]
    tokens: Mapping[str, int]
    processor: Mapping[str, Any] = field(default_factory=dict)
    named: Mapping[str, str] = field(default_factory=dict)
    parameters: int | None = None

    def write(self, folder: Path) -> None:
        """Write the files that a checkpoint's processor and model are built from, into an existing
        folder; the tokenizer knows the special tokens alone."""
        files = {
            "config.json": self.config,
            "preprocessor_config.json": self.images,
            "processor_config.json": self.processor,
        }
        for name, content in files.items():
            if content:
                (folder / name).write_text(json.dumps(content), encoding="utf-8")
        ids = {_UNKNOWN: 0, **self.tokens}
        tokenizer = Tokenizer(models.WordLevel(ids, unk_token=_UNKNOWN))
        tokenizer.add_special_tokens(list(ids))
        PreTrainedTokenizerFast(
            tokenizer_object=tokenizer,
            unk_token=_UNKNOWN,
            pad_token=_UNKNOWN,
            eos_token=_UNKNOWN,
            extra_special_tokens=dict(self.named),
        ).save_pretrained(folder)


@cache
def known_checkpoints() -> Mapping[str, KnownCheckpoint]:
    """Return the checkpoints whose configs are kept here, by their ids on the hub."""
    table = read_yaml(_TABLE, "install infthor-eval again")
    return {name: KnownCheckpoint(**settings) for name, settings in table.items()}
