"""A checkpoint's model, and what prepares its prompts, on a device that computes no numbers.

The configs of published checkpoints are kept here, so that they can be rehearsed without network.

To add a checkpoint that can be rehearsed without its files: a paragraph in
`model_adapters/hf/rehearsal/checkpoints.yaml`, with a source to compare it with.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import torch
from PIL import Image
from tokenizers import Tokenizer, models
from transformers import PreTrainedTokenizerFast

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.storage.scratch import ScratchFolder
from model_adapters.hf.families.hf_lm import TextFamily
from model_adapters.hf.families.hf_vlm import HfVlm, find_family
from model_adapters.hf.family import Family
from model_adapters.hf.loading.checkpoint import (
    LocatedCheckpoint,
    build_meta_model,
    read_checkpoint,
    resolve_dtype,
)
from model_adapters.hf.loading.rope import apply_rope
from model_adapters.hf.rehearsal.device import ShapesDevice
from model_adapters.hf.uncached import expand_image_tokens
from model_adapters.options.checkpoints import CheckpointOptions

_CONFIG = "config.json"
_TABLE = Path(__file__).with_name("checkpoints.yaml")
_UNKNOWN = "<unk>"


@dataclass(frozen=True)
class RehearsedModel:
    """A model of shapes.

    Attributes:
        model: the transformers model.
        family: family of the model.
        options: options of the model.
        device: the device that it is on.
        weights: bytes of its weights and buffers.
        source: where its config is from.
        limit: context limit in tokens, or None.
        process: scales and cuts images, as a run does; None if frames cannot be counted.
        problem: why frames cannot be counted; empty if they can.
    """

    model: Any
    family: Family
    options: CheckpointOptions
    device: ShapesDevice
    weights: int
    source: str
    limit: int | None
    process: Callable[[Sequence[Image.Image]], Any] | None = None
    problem: str = ""


def load_shapes(options: CheckpointOptions) -> RehearsedModel:
    """Build a checkpoint's model from its config alone."""
    _refuse_options(options)
    if options.pretrained and (Path(options.pretrained) / _CONFIG).is_file():
        return _load(options, f"{options.pretrained}/{_CONFIG}")
    known = known_checkpoints().get(options.pretrained)
    if known is None:
        raise UsageError(
            f"pretrained={options.pretrained}: no folder with a config.json, and no config is kept "
            f"here; get one with `hf download {options.pretrained or 'OWNER/NAME'} --include "
            "'*.json' '*.jinja' --local-dir DIR` and give pretrained=DIR, or name one of "
            f"{', '.join(known_checkpoints())}"
        )
    with ScratchFolder() as folder:
        known.write(folder)
        stored = replace(options, pretrained=str(folder), revision=None, prompt="plain")
        loaded = _load(stored, known.source)
        problem = loaded.problem.replace(str(folder), options.pretrained)
        return replace(loaded, options=options, problem=problem)


def _refuse_options(options: CheckpointOptions) -> None:
    for name in ("kv_offload", "quantization", "attention"):
        if getattr(options, name):
            raise UsageError(
                f"{name} cannot be rehearsed: memory would be counted wrongly; leave it out"
            )


def _load(options: CheckpointOptions, source: str) -> RehearsedModel:
    located = HfVlm.locate("hf-vlm", options)
    device = ShapesDevice()
    build = partial(_build, device=device)
    try:
        family, processor = find_family(located)
        loaded = read_checkpoint(located, family, build)
    except ModelError as error:
        limit = apply_rope(located.config, options.rope)
        device = ShapesDevice()  # the error may keep a first model
        model = _build(located, device)
        text = TextFamily(model)
        return RehearsedModel(
            model, text, options, device, device.allocated, source, limit, problem=str(error)
        )
    process: Callable[[Sequence[Image.Image]], Any] = partial(expand_image_tokens, processor)
    if processor is None:
        process = partial(loaded.image_processor, return_tensors="pt")
    weights = device.allocated
    return RehearsedModel(
        loaded.model, loaded.family, options, device, weights, source, loaded.max_tokens, process
    )


def _build(located: LocatedCheckpoint[CheckpointOptions], device: ShapesDevice) -> Any:
    """Return the model in the type and with the kernel that the options name, and count its
    memory."""
    dtype = resolve_dtype(located.options)
    if isinstance(dtype, torch.dtype):
        located.config.dtype = dtype
    located.config._attn_implementation = located.options.attn_implementation
    with device.running():
        return build_meta_model(located).eval()


@dataclass(frozen=True)
class _KnownCheckpoint:
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
def known_checkpoints() -> Mapping[str, _KnownCheckpoint]:
    """Return the checkpoints whose configs are kept here, by their ids on the hub."""
    table = read_yaml(_TABLE, "install infthor-eval again")
    return {name: _KnownCheckpoint(**settings) for name, settings in table.items()}
