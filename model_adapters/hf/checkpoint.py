"""Loading a checkpoint from the hub or a folder, without torchvision and without remote code.

transformers' processor classes of video-capable families cannot be built without torchvision, so the parts that a
conversation needs (image processor, tokenizer, chat template) are loaded one by one. Image processors are always the
PIL ones: torchvision's resize gives other pixels, and the numbers must not depend on what else is installed.
"""

import contextlib
import json
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar, cast

import PIL
import tokenizers
import torch
import transformers

from infthor_eval.errors import ModelError, UsageError, wrap_errors
from infthor_eval.formats.digests import digest, digest_of_files
from infthor_eval.formats.reading import require_plain_files
from model_adapters.hf.decoding import read_generation
from model_adapters.hf.family import Family, MakeFamily
from model_adapters.hf.hub import fetch
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.rope import apply_rope
from model_adapters.hf.templates import chat_template, plain_template
from model_adapters.options.checkpoints import CheckpointOptions, CheckpointReading, Placement

__all__ = [
    "LocatedCheckpoint",
    "assemble",
    "load_checkpoint",
    "loading",
    "locate",
    "origin",
    "outline",
    "read_checkpoint",
    "resolve_device",
    "resolve_dtype",
    "versions",
]

_DTYPES = (torch.bfloat16, torch.float16, torch.float32, torch.float64)
_GENERATION = "generation_config.json"
_FINGERPRINTED = {".bin", ".jinja", ".json", ".model", ".safetensors", ".txt"}

R = TypeVar("R", bound=CheckpointReading)
R_co = TypeVar("R_co", bound=CheckpointReading, covariant=True)


@dataclass(frozen=True)
class LocatedCheckpoint(Generic[R_co]):
    """A checkpoint that was found, not yet loaded.

    Attributes:
        folder: where it lies.
        commit: of the hub's repository; None for a folder of the user's.
        config: its config.
        options: what was asked for.
    """

    folder: Path
    commit: str | None
    config: Any
    options: R_co


def locate(options: R) -> LocatedCheckpoint[R]:
    """Find a checkpoint and read its config.

    Raises:
        ModelError: there is none, or it cannot be had.
    """
    folder, commit = fetch(options.pretrained, options.revision)
    require_plain_files(folder, "restore the checkpoint")
    with loading(options.pretrained):
        config = transformers.AutoConfig.from_pretrained(folder, trust_remote_code=options.trust_remote_code)
    return LocatedCheckpoint(folder, commit, config, options)


def load_checkpoint(located: LocatedCheckpoint[CheckpointOptions], family: MakeFamily) -> Loaded:
    """Load everything a conversation needs, its weights too.

    Args:
        located: the checkpoint.
        family: makes the family of a model, an image processor and a tokenizer.

    Raises:
        ModelError: the checkpoint is incomplete or damaged.
        UsageError: there is no such dtype or device.
    """
    return read_checkpoint(located, family, _load_model)


def read_checkpoint(
    located: LocatedCheckpoint[R], family: MakeFamily, make_model: Callable[[LocatedCheckpoint[R]], Any]
) -> Loaded:
    """Load everything a conversation needs.

    Args:
        located: the checkpoint; an extension of the context is written into its config.
        family: makes the family of a model, an image processor and a tokenizer.
        make_model: makes the model of the config; `outline` does without weights.

    Raises:
        ModelError: the checkpoint is incomplete or damaged.
        UsageError: what making the model raises.
    """
    options, folder = located.options, located.folder
    remote = {"trust_remote_code": options.trust_remote_code}
    with loading(options.pretrained):
        image_processor = transformers.AutoImageProcessor.from_pretrained(
            folder, backend="pil", **remote, **options.image_settings()
        )
        tokenizer = transformers.AutoTokenizer.from_pretrained(folder, **remote)
        template = chat_template(folder, tokenizer) if options.prompt == "chat" else None
        max_tokens = apply_rope(located.config, options.rope)
        model = make_model(located)
        made = family(model, image_processor, tokenizer)
        return assemble(
            model,
            tokenizer,
            image_processor,
            template=plain_template(tokenizer, made) if template is None else template,
            family=made,
            max_tokens=max_tokens,
            origin=origin(located.folder, located.commit, options.pretrained),
        )


def outline(located: LocatedCheckpoint[Any]) -> Any:
    """The model of a checkpoint whose weights another engine holds: shapes alone, which take no memory.

    What frames become in tokens can be told by it as by the model itself.
    """
    with torch.device("meta"):
        model = cast(Any, transformers.AutoModelForImageTextToText).from_config(
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
) -> Loaded:
    """Put loaded parts together and write down what identifies them.

    Args:
        model: the transformers model.
        tokenizer: its tokenizer.
        image_processor: its image processor.
        template: what writes a conversation (Jinja).
        family: its family.
        max_tokens: its context limit.
        origin: where the weights come from, for the identity.

    Raises:
        ModelError: its generation settings are not supported, or its smallest frame is larger than its largest.
    """
    _check_pixels(image_processor)
    identity = dict(origin) | {
        "class": type(model).__name__,
        "n_parameters": model.num_parameters(),
        "dtype": str(model.dtype).removeprefix("torch."),
        "device": model.device.type,
        "quantization": _quantized(model),
        "attn_implementation": model.config._attn_implementation,
        "rope": getattr(model.config.get_text_config(), "rope_parameters", None),
        "image_processor": json.loads(image_processor.to_json_string()),
        "chat_template": digest(template),
        "versions": versions(),
    }
    return Loaded(
        model=model.eval(),
        tokenizer=tokenizer,
        image_processor=image_processor,
        template=template,
        family=family,
        generation=read_generation(model.generation_config),
        max_tokens=max_tokens,
        identity=identity,
    )


def _check_pixels(image_processor: Any) -> None:
    size = dict(getattr(image_processor, "size", None) or {})
    least, most = size.get("shortest_edge"), size.get("longest_edge")
    if least is not None and most is not None and least > most:
        raise ModelError(f"frames of {least} pixels at least and {most} at most; set min_pixels and max_pixels to fit")


def origin(folder: Path, commit: str | None, pretrained: str) -> dict[str, Any]:
    """Where weights come from, for an identity.

    Args:
        folder: where the checkpoint lies.
        commit: of the hub's repository; None for a folder of the user's.
        pretrained: what was asked for.
    """
    if commit is not None:
        return {"checkpoint": pretrained, "revision": commit}
    # The folder's name, not its place: a checkpoint that was moved is the same checkpoint.
    return {"checkpoint": folder.resolve().name, "fingerprint": _fingerprint(folder)}


def versions() -> dict[str, str]:
    """Versions of the libraries that numbers hang on, for an identity."""
    return {
        "torch": torch.__version__,
        "transformers": transformers.__version__,
        "tokenizers": tokenizers.__version__,
        "pillow": PIL.__version__,
    }


def resolve_device(options: Placement) -> torch.device:
    """The device asked for; auto is the GPU where there is one.

    Raises:
        UsageError: torch knows no such device.
        ModelError: there is no GPU here.
    """
    name = options.device
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    with wrap_errors(
        f"device={name} is not a torch device", "use cpu, cuda, cuda:1, ...", catch=RuntimeError, raise_as=UsageError
    ):
        device = torch.device(name)
    if device.type == "meta":
        raise UsageError(f"device={name} computes nothing; use cpu, cuda, cuda:1, ...")
    if device.type == "cuda" and not torch.cuda.is_available():
        raise ModelError(f"device={name}: torch {torch.__version__} finds no GPU here; use device=cpu")
    # Each back end says in its own way that it is not there.
    with wrap_errors(
        f"device={name}: torch {torch.__version__} has none here", "use cpu", catch=Exception, raise_as=ModelError
    ):
        torch.empty(1, device=device)
    return device


def resolve_dtype(options: Placement) -> torch.dtype | str:
    """The type asked for, or "auto".

    Raises:
        UsageError: torch has no such type.
    """
    dtype = "auto" if options.dtype == "auto" else getattr(torch, options.dtype, None)
    if not (dtype == "auto" or dtype in _DTYPES):
        raise UsageError(f"dtype={options.dtype} is no type of weights; use auto, bfloat16, float16 or float32")
    return dtype


@contextlib.contextmanager
def loading(pretrained: str) -> Iterator[None]:
    """Turn the errors of transformers' loading into one line, and its bar off where there is no terminal.

    Args:
        pretrained: what was asked for, for the message.

    Raises:
        ModelError: something could not be loaded.
    """
    # There is no end to what transformers, tokenizers and safetensors raise on files that somebody damaged.
    mend = "restore its files, or give another checkpoint"
    if not sys.stderr.isatty():  # a log would have the bar as a line
        transformers.utils.logging.disable_progress_bar()
    with wrap_errors(f"the checkpoint {pretrained} cannot be loaded", mend, catch=Exception, raise_as=ModelError):
        yield


def _load_model(located: LocatedCheckpoint[CheckpointOptions]) -> Any:
    options = located.options
    device = resolve_device(options)
    model, report = cast(Any, transformers.AutoModelForImageTextToText).from_pretrained(
        located.folder,
        config=located.config,
        dtype=resolve_dtype(options),
        attn_implementation=options.attn_implementation,
        device_map=options.device_map or ({"": device} if options.quantization else None),
        quantization_config=_quantization(options),
        trust_remote_code=options.trust_remote_code,
        use_safetensors=True,  # a pickle is code
        output_loading_info=True,
    )
    missing = sorted(report["missing_keys"])
    if missing:  # transformers would leave them random and only warn
        raise ModelError(f"{options.pretrained} lacks {len(missing)} weights of its model ({missing[0]}, ...)")
    return model if options.device_map or options.quantization else model.to(device)


def _quantization(options: CheckpointOptions) -> Any:
    if options.quantization is None:
        return None
    switch = {"bnb4": "load_in_4bit", "bnb8": "load_in_8bit"}[options.quantization]
    return transformers.BitsAndBytesConfig(**{switch: True})


def _quantized(model: Any) -> str | None:
    """Method of quantisation, asked for or the checkpoint's own."""
    settings = getattr(model.config, "quantization_config", None)
    method = settings.get("quant_method") if isinstance(settings, dict) else getattr(settings, "quant_method", None)
    return None if method is None else str(getattr(method, "value", method))


def _fingerprint(folder: Path) -> str:
    """Hash of names and contents of the checkpoint's files (hex, 32 characters)."""
    return digest_of_files(
        path for path in sorted(folder.iterdir()) if path.suffix in _FINGERPRINTED and path.is_file()
    )
