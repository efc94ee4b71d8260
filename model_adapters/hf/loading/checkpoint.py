"""Loading of a checkpoint from the hub or a folder, without torchvision and without remote code.

transformers cannot build the processors of video-capable families without torchvision, so the parts
that a conversation needs (image processor, tokenizer, chat template) are loaded one by one.
"""

import contextlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Generic, TypeVar

import PIL
import tokenizers
import torch
import transformers
from transformers.utils import is_torchvision_available

from infthor_eval.errors import ModelError, UsageError, wrap_errors
from infthor_eval.formats.reading import require_plain_files
from infthor_eval.storage.digests import digest, digest_of_files
from model_adapters.hf.cached.decoding import read_generation
from model_adapters.hf.family import Family, MakeFamily
from model_adapters.hf.global_settings import hide_transformers_output
from model_adapters.hf.loading.card import read_card_words
from model_adapters.hf.loading.hub import fetch
from model_adapters.hf.loading.image_processors import image_backend, load_image_processor
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.loading.packed_attention import pack_attention
from model_adapters.hf.loading.rope import apply_rope
from model_adapters.hf.prompting.templates import chat_template, plain_template
from model_adapters.options.checkpoints import CheckpointOptions, CheckpointReading, Placement

_DTYPES = (torch.bfloat16, torch.float16, torch.float32, torch.float64)
_GENERATION = "generation_config.json"
_FINGERPRINTED = {".bin", ".jinja", ".json", ".model", ".safetensors", ".txt"}

R = TypeVar("R", bound=CheckpointReading)
R_co = TypeVar("R_co", bound=CheckpointReading, covariant=True)


@dataclass(frozen=True)
class LocatedCheckpoint(Generic[R_co]):
    """A checkpoint on disk.

    Attributes:
        folder: folder of the checkpoint.
        commit: commit of the hub's repository, or None for a folder of the user's.
        config: config of the model.
        options: options of the model.
        has_vision: False for a language model alone, which has no image processor.
    """

    folder: Path
    commit: str | None
    config: Any
    options: R_co
    has_vision: bool = True

    @property
    def auto_class(self) -> Any:
        """Class of transformers that finds the model's."""
        return (
            transformers.AutoModelForImageTextToText
            if self.has_vision
            else transformers.AutoModelForCausalLM
        )


def locate(options: R) -> LocatedCheckpoint[R]:
    """Find or download a checkpoint and read its config."""
    folder, commit = fetch(options.pretrained, options.revision)
    require_plain_files(folder, "restore the checkpoint")
    if (folder / ".metadata").is_file():
        raise ModelError(
            f"{options.pretrained} is a distributed checkpoint of a trainer; convert it with "
            f"`infthor-eval import-checkpoint {options.pretrained} --out DIR` and give "
            "pretrained=DIR"
        )
    with wrap_loading_errors(options.pretrained):
        config = transformers.AutoConfig.from_pretrained(
            folder, trust_remote_code=options.trust_remote_code
        )
    return LocatedCheckpoint(folder, commit, config, options)


def load_checkpoint(
    located: LocatedCheckpoint[CheckpointOptions], family: MakeFamily
) -> LoadedCheckpoint:
    """Load everything that a conversation needs, including the weights."""
    return read_checkpoint(located, family, _load_model)


def read_checkpoint(
    located: LocatedCheckpoint[R],
    make_family: MakeFamily,
    build_model: Callable[[LocatedCheckpoint[R]], Any],
) -> LoadedCheckpoint:
    """Load everything that a conversation needs.

    A context extension is written into the config; `build_model` builds its model,
    `build_meta_model` without weights.
    """
    options = located.options
    folder = located.folder
    remote = {"trust_remote_code": options.trust_remote_code}
    with wrap_loading_errors(options.pretrained):
        image_processor = (
            load_image_processor(folder, options, **remote, **options.image_settings())
            if located.has_vision
            else None
        )
        tokenizer = transformers.AutoTokenizer.from_pretrained(folder, **remote)
        template = chat_template(folder, tokenizer) if options.prompt == "chat" else None
        max_tokens = apply_rope(located.config, options.rope)
        model = build_model(located)
        family = make_family(model, image_processor, tokenizer)
        return assemble(
            model,
            tokenizer,
            image_processor,
            template=plain_template(tokenizer, family) if template is None else template,
            family=family,
            max_tokens=max_tokens,
            origin=origin(located.folder, located.commit, options.pretrained),
        )


def build_meta_model(located: LocatedCheckpoint[Any]) -> Any:
    """Return a checkpoint's model on torch's meta device: shapes without weights or memory.

    It is enough for counting a frame's tokens, if another engine has the weights.
    """
    with torch.device("meta"):
        model = located.auto_class.from_config(
            located.config, trust_remote_code=located.options.trust_remote_code
        )
    if (located.folder / _GENERATION).is_file():
        model.generation_config = transformers.GenerationConfig.from_pretrained(located.folder)
    return model


def assemble(
    model: Any,
    tokenizer: Any,
    image_processor: Any,
    *,
    template: str,
    family: Family,
    max_tokens: int | None,
    origin: Mapping[str, Any],
) -> LoadedCheckpoint:
    """Combine loaded parts and derive their identity, which begins with the weights' `origin`."""
    pack_attention(model)
    # torch rounds convolutions in float32 to ten bits on a GPU, and vision towers begin with one.
    torch.backends.cudnn.allow_tf32 = False
    identity = dict(origin) | {
        "class": type(model).__name__,
        "n_parameters": model.num_parameters(),
        "dtype": str(model.dtype).removeprefix("torch."),
        "device": model.device.type,
        "quantization": _quantization_method(model),
        "attn_implementation": model.config.get_text_config()._attn_implementation,
        "rope": getattr(model.config.get_text_config(), "rope_parameters", None),
        "chat_template": digest(template),
        "versions": versions(),
    }
    if image_processor is not None:
        identity |= _image_identity(image_processor)
    return LoadedCheckpoint(
        model=model.eval(),
        tokenizer=tokenizer,
        image_processor=image_processor,
        template=template,
        family=family,
        generation=read_generation(model.generation_config),
        max_tokens=max_tokens,
        identity=identity,
    )


def _image_identity(image_processor: Any) -> dict[str, Any]:
    """Return what an identity says of an image processor, whose settings are checked."""
    _check_pixels(image_processor)
    identity = {"image_processor": json.loads(image_processor.to_json_string())}
    # Where it is not installed, the same is computed without it.
    if image_backend(image_processor) == "torchvision" and is_torchvision_available():
        identity["image_backend"] = f"torchvision {version('torchvision')}"
    return identity


def _check_pixels(image_processor: Any) -> None:
    size = dict(getattr(image_processor, "size", None) or {})
    least = size.get("shortest_edge")
    most = size.get("longest_edge")
    if least is not None and most is not None and least > most:
        raise ModelError(f"min_pixels is {least} and max_pixels {most}; set both to fit")


def origin(folder: Path, commit: str | None, pretrained: str) -> dict[str, Any]:
    """Return the source of weights, for an identity, and what the card says it was trained on.

    The commit is None for a folder of the user's.
    """
    words = read_card_words(folder)
    trained = {} if words is None else {"trained_words": words}
    if commit is not None:
        return {"checkpoint": pretrained, "revision": commit} | trained
    # The folder's name, not its path: a moved checkpoint is the same checkpoint.
    files = (
        path
        for path in sorted(folder.iterdir())
        if path.suffix in _FINGERPRINTED and path.is_file()
    )
    return {"checkpoint": folder.resolve().name, "fingerprint": digest_of_files(files)} | trained


def versions() -> dict[str, str]:
    """Return the versions of the libraries that results depend on, for an identity."""
    return {
        "torch": torch.__version__,
        "transformers": transformers.__version__,
        "tokenizers": tokenizers.__version__,
        "pillow": PIL.__version__,
    }


def resolve_device(options: Placement) -> torch.device:
    """Return the torch device of the options; auto is the GPU if there is one."""
    name = options.device
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    problem = f"device={name} is not a torch device"
    hint = "use cpu, cuda, cuda:1, ..."
    with wrap_errors(problem, hint, catch=RuntimeError, raise_as=UsageError):
        device = torch.device(name)
    if device.type == "meta":
        raise UsageError(f"device={name} computes nothing; {hint}")
    if device.type == "cuda" and not torch.cuda.is_available():
        raise ModelError(
            f"device={name}: torch {torch.__version__} finds no GPU here; use device=cpu"
        )
    # Each back end raises its own error if it is missing.
    problem = f"device={name}: torch {torch.__version__} has none here"
    with wrap_errors(problem, "use cpu", catch=Exception, raise_as=ModelError):
        torch.empty(1, device=device)
    return device


def resolve_dtype(options: Placement) -> torch.dtype | str:
    """Return the torch type of the options, or "auto"."""
    dtype = "auto" if options.dtype == "auto" else getattr(torch, options.dtype, None)
    if not (dtype == "auto" or dtype in _DTYPES):
        raise UsageError(
            f"dtype={options.dtype} is not a type of weights; use auto, bfloat16, float16 or "
            "float32"
        )
    return dtype


@contextlib.contextmanager
def wrap_loading_errors(pretrained: str) -> Iterator[None]:
    """Turn errors of transformers' loading into one line, and hide its progress bars and warnings.

    What its warnings say is either an error here (missing weights) or of no concern to users.
    """
    problem = f"the checkpoint {pretrained} cannot be loaded"
    hint = "restore its files, or give another checkpoint"
    # transformers, tokenizers and safetensors raise errors of any type on damaged files.
    with (
        wrap_errors(problem, hint, catch=Exception, raise_as=ModelError),
        hide_transformers_output(),
    ):
        yield


def _load_model(located: LocatedCheckpoint[CheckpointOptions]) -> Any:
    options = located.options
    device = resolve_device(options)
    attention: str | dict[str, str] = options.attn_implementation
    text = located.config.get_text_config()
    # Gemma 2 caps its scores, which torch's kernel cannot.
    if attention == "sdpa" and getattr(text, "attn_logit_softcapping", None):
        is_whole = text is located.config  # a language model alone
        attention = "eager" if is_whole else {"": "sdpa", "text_config": "eager"}
    model, report = located.auto_class.from_pretrained(
        located.folder,
        config=located.config,
        dtype=resolve_dtype(options),
        attn_implementation=attention,
        device_map=options.device_map or ({"": device} if options.quantization else None),
        quantization_config=_quantization(options),
        trust_remote_code=options.trust_remote_code,
        use_safetensors=True,  # a pickle is code
        output_loading_info=True,
    )
    missing = sorted(report["missing_keys"])
    if missing:  # transformers would draw them at random and only warn
        raise ModelError(
            f"{options.pretrained} lacks {len(missing)} weights of its model ({missing[0]}, ...)"
        )
    if model.get_input_embeddings().weight.is_meta:
        raise ModelError(
            f"device_map={options.device_map} has no room for the embeddings of "
            f"{options.pretrained}; use quantization=bnb4, more GPUs, or device_map=none"
        )
    return model if options.device_map or options.quantization else model.to(device)


def _quantization(options: CheckpointOptions) -> Any:
    if options.quantization is None:
        return None
    switch = {"bnb4": "load_in_4bit", "bnb8": "load_in_8bit"}[options.quantization]
    return transformers.BitsAndBytesConfig(**{switch: True})


def _quantization_method(model: Any) -> str | None:
    """Return the method of quantisation, of the options or of the checkpoint."""
    settings = getattr(model.config, "quantization_config", None)
    method = (
        settings.get("quant_method")
        if isinstance(settings, dict)
        else getattr(settings, "quant_method", None)
    )
    return None if method is None else str(getattr(method, "value", method))
