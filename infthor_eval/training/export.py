"""Writing of a trained model as a checkpoint that its family's adapter loads."""

from collections.abc import Mapping
from pathlib import Path

import torch
from safetensors import SafetensorError
from torch.distributed.tensor import DTensor

from infthor_eval.errors import wrap_errors
from infthor_eval.formats.object_ids import Words
from infthor_eval.storage.scratch import ScratchFolder
from model_adapters.hf.global_settings import hide_transformers_output
from model_adapters.hf.loading.card import WORDS
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.loading.tower_names import with_published_names

_CONFIG = "config.json"
_CARD = f"""\
---
library_name: transformers
{WORDS}: {{words}}
---
# {{title}}

Trained with infthor-eval, on plans and actions in the {{words}} words (`--words {{words}}` in \
evaluation).
"""


def gather_weights(model: torch.nn.Module) -> dict[str, torch.Tensor] | None:
    """Gather weights that are sharded over processes, or return None if they are not.

    All processes have to call this.
    """
    weights = model.state_dict()
    if not any(isinstance(tensor, DTensor) for tensor in weights.values()):
        return None
    return {
        name: tensor.full_tensor().cpu() if isinstance(tensor, DTensor) else tensor
        for name, tensor in weights.items()
    }


def export(
    loaded: LoadedCheckpoint,
    folder: Path,
    *,
    title: str,
    words: Words,
    weights: Mapping[str, torch.Tensor] | None = None,
) -> None:
    """Write weights by published names (safetensors), configs, tokenizer, image processor, card.

    The template is that of training, so that evaluation renders the same prompts. The card has the
    title of the recipe and the words of plans and actions. The folder is created; each file appears
    in it when it is whole, and the config, which makes it a checkpoint, last. `weights` are the
    gathered ones of a sharded model.
    """
    with wrap_errors(
        f"{folder}: the checkpoint cannot be written",
        "free some space, or choose another folder",
        catch=(OSError, SafetensorError),
    ):
        folder.mkdir(parents=True, exist_ok=True)
        with ScratchFolder(folder) as whole:
            _write(loaded, whole, title, words, weights)
            for file in sorted(whole.iterdir(), key=lambda file: file.name == _CONFIG):
                file.replace(folder / file.name)


def _write(
    loaded: LoadedCheckpoint,
    folder: Path,
    title: str,
    words: Words,
    weights: Mapping[str, torch.Tensor] | None,
) -> None:
    loaded.tokenizer.chat_template = loaded.template
    with hide_transformers_output():
        _write_tokenizer(loaded, folder)
        loaded.image_processor.save_pretrained(folder)
        own = loaded.model.state_dict() if weights is None else weights
        loaded.model.save_pretrained(folder, state_dict=with_published_names(own))
    for file in folder.glob("*.safetensors"):  # safetensors writes them for their owner alone
        file.chmod((folder / _CONFIG).stat().st_mode)
    (folder / "README.md").write_text(_CARD.format(title=title, words=words), encoding="utf-8")


def _write_tokenizer(loaded: LoadedCheckpoint, folder: Path) -> None:
    try:
        loaded.tokenizer.save_pretrained(folder)
    except OSError:
        raise
    except Exception as error:  # the library in Rust has no other kind, for a full disk either
        raise OSError(str(error)) from error
