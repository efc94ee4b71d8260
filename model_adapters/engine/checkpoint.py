"""Loading a checkpoint from the hub or a folder, without torchvision and without remote code.

transformers' processor classes of video-capable families cannot be built without torchvision, so the parts that a
conversation needs (image processor, tokenizer, chat template) are loaded one by one. Image processors are always the
PIL ones: torchvision's resize gives other pixels, and the numbers must not depend on what else is installed.
"""

import contextlib
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import PIL
import torch
import transformers
from transformers.utils import cached_file

from infthor_eval.errors import ModelError, UsageError
from model_adapters.engine.decoding import read_generation
from model_adapters.engine.family import Family
from model_adapters.engine.loaded import Loaded
from model_adapters.engine.options import CheckpointOptions, EngineOptions

__all__ = ["assemble", "load_checkpoint", "resolve_device", "resolve_dtype"]

_FINGERPRINTED = {".bin", ".jinja", ".json", ".model", ".safetensors", ".txt"}


def load_checkpoint(
    options: CheckpointOptions,
    family: Callable[[Any, Any], Family],
    model_types: Sequence[str],
    image_settings: Mapping[str, Any],
) -> Loaded:
    """Load everything a conversation needs.

    Args:
        options: where from, and how to run it.
        family: makes the family of a model and an image processor.
        model_types: the `model_type`s in a config that the family can run.
        image_settings: settings of the image processor that differ from the checkpoint's.

    Raises:
        ModelError: the checkpoint is missing, incomplete, of another family, or cannot be had.
        UsageError: there is no such dtype.
    """
    name = options.pretrained
    source = {"revision": options.revision, "trust_remote_code": options.trust_remote_code}
    with _one_line(options):
        config = transformers.AutoConfig.from_pretrained(name, **source)
        if config.model_type not in model_types:
            raise ModelError(f"{name} is a {config.model_type} checkpoint, not {' or '.join(model_types)}")
        image_processor = transformers.AutoImageProcessor.from_pretrained(
            name, backend="pil", **source, **image_settings
        )
        tokenizer = transformers.AutoTokenizer.from_pretrained(name, **source)
        template = _chat_template(options, tokenizer)
        model = _load_model(options, source)
    return assemble(
        model,
        tokenizer,
        image_processor,
        template=template,
        family=family(model, image_processor),
        origin=_origin(name, options.revision, config),
    )


def assemble(
    model: Any,
    tokenizer: Any,
    image_processor: Any,
    *,
    template: str,
    family: Family,
    origin: Mapping[str, Any],
) -> Loaded:
    """Put loaded parts together and write down what identifies them.

    Args:
        model: the transformers model.
        tokenizer: its tokenizer.
        image_processor: its image processor.
        template: its chat template.
        family: its family.
        origin: where the weights come from, for the identity.

    Raises:
        ModelError: its generation settings are not supported.
    """
    text_config = model.config.get_text_config()
    identity = dict(origin) | {
        "class": type(model).__name__,
        "dtype": str(model.dtype).removeprefix("torch."),
        "device": model.device.type,
        "attn_implementation": model.config._attn_implementation,
        "image_processor": json.loads(image_processor.to_json_string()),
        "chat_template": _digest(template.encode()),
        "versions": {
            "torch": torch.__version__,
            "transformers": transformers.__version__,
            "pillow": PIL.__version__,
        },
    }
    return Loaded(
        model=model.eval(),
        tokenizer=tokenizer,
        template=template,
        family=family,
        generation=read_generation(model.generation_config),
        max_tokens=getattr(text_config, "max_position_embeddings", None),
        identity=identity,
    )


def resolve_device(options: EngineOptions) -> torch.device:
    """The device asked for; auto is the GPU where there is one.

    Raises:
        UsageError: torch knows no such device.
        ModelError: there is no GPU here.
    """
    name = options.device
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
    except RuntimeError as error:
        raise UsageError(f"device={name} is not a torch device; use cpu, cuda, cuda:1, ...") from error
    if device.type == "cuda" and not torch.cuda.is_available():
        raise ModelError(f"device={name}: torch {torch.__version__} finds no GPU here; use device=cpu")
    return device


def resolve_dtype(options: EngineOptions) -> torch.dtype | str:
    """The type asked for, or "auto".

    Raises:
        UsageError: torch has no such type.
    """
    dtype = "auto" if options.dtype == "auto" else getattr(torch, options.dtype, None)
    if not (dtype == "auto" or isinstance(dtype, torch.dtype)):
        raise UsageError(f"dtype={options.dtype} is not a torch type; use auto, bfloat16, float16 or float32")
    return dtype


@contextlib.contextmanager
def _one_line(options: CheckpointOptions) -> Iterator[None]:
    """Turn the errors of loading into one line with the mend."""
    name = options.pretrained
    path = Path(name).expanduser()
    if name.startswith((".", "/", "~")) and not path.is_dir():
        raise ModelError(f"pretrained={name}: there is no such folder")
    try:
        yield
    except (OSError, ValueError, ImportError, KeyError) as error:
        reason = " ".join(str(error).split())[:200]
        if path.is_dir():
            raise ModelError(f"the checkpoint in {name} cannot be loaded: {reason}") from error
        where = f"{name} at revision {options.revision}" if options.revision else name
        raise ModelError(
            f"checkpoint {where} cannot be had from the hub ({reason}); download it elsewhere with "
            f"`hf download {name} --local-dir DIR` and give pretrained=DIR, or log in with `hf auth login`"
        ) from error


def _load_model(options: CheckpointOptions, source: Mapping[str, Any]) -> Any:
    device = resolve_device(options)
    model, report = cast(Any, transformers.AutoModelForImageTextToText).from_pretrained(
        options.pretrained,
        dtype=resolve_dtype(options),
        attn_implementation=options.attn_implementation,
        device_map=options.device_map,
        output_loading_info=True,
        **source,
    )
    missing = sorted(report["missing_keys"])
    if missing:  # transformers would leave them random and only warn
        raise ModelError(f"{options.pretrained} lacks {len(missing)} weights of its model ({missing[0]}, ...)")
    return model if options.device_map else model.to(device)


def _chat_template(options: CheckpointOptions, tokenizer: Any) -> str:
    """The processor's template if the checkpoint has one of its own, else the tokenizer's."""
    template = None
    for file in ("chat_template.jinja", "chat_template.json"):
        path = cached_file(
            options.pretrained,
            file,
            revision=options.revision,
            _raise_exceptions_for_missing_entries=False,
        )
        if path is not None:
            text = Path(path).read_text(encoding="utf-8")
            template = json.loads(text)["chat_template"] if file.endswith(".json") else text
            break
    template = template or tokenizer.chat_template
    if not isinstance(template, str):
        raise ModelError(f"{options.pretrained} has no chat template; add a chat_template.jinja to it")
    return template


def _origin(name: str, revision: str | None, config: Any) -> dict[str, Any]:
    path = Path(name).expanduser()
    if path.is_dir():
        # The folder's name, not its place: a checkpoint that was moved is the same checkpoint.
        return {"checkpoint": path.resolve().name, "fingerprint": _fingerprint(path)}
    return {"checkpoint": name, "revision": config._commit_hash or revision}


def _fingerprint(folder: Path) -> str:
    """Hash of names and contents of the checkpoint's files (hex, 32 characters)."""
    whole = hashlib.blake2b(digest_size=16)
    for path in sorted(folder.iterdir()):
        if path.suffix in _FINGERPRINTED and path.is_file():
            with path.open("rb") as file:
                content = hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16))
            whole.update(f"{path.name}\n{content.hexdigest()}\n".encode())
    return whole.hexdigest()


def _digest(data: bytes) -> str:
    return hashlib.blake2b(data, digest_size=16).hexdigest()
