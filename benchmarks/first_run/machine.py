"""What a first run finds: the device, the weights, the data set, and libraries of others."""

import importlib.util
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

import torch

from infthor_eval.nieh.published.hub_data import default_folder

__all__ = ["CHECKPOINT", "Machine", "find_machine"]

_TINY_FRAMES = 24
# No step that is done without them looks at them; with weights, some steps take others.
_FOR_SOME = ("data", "old_libraries")
CHECKPOINT = "Qwen/Qwen2.5-VL-7B-Instruct"


@dataclass(frozen=True, kw_only=True)
class Machine:
    """The machine of a first run.

    Attributes:
        device: cuda or cpu.
        name: name of the GPU, or of the processor's kind.
        gpus: number of GPUs that may be used.
        memory_gib: memory of the first GPU; 0.0 without one.
        tiny: whether tiny models stand for the real ones, and pieces of the work for the whole.
        checkpoint: folder of the real model's weights, or its name where they may be downloaded;
            None without.
        data: folder of the published set, there or to be downloaded; None without.
        download: whether the data set is downloaded where it is not there.
        old_libraries: folders of the libraries of the policies' publication, with colons between
            them; None without.
        flash: whether flash-attn is installed.
        frames: frames of the long trajectory that speeds are measured on.
    """

    device: str
    name: str
    gpus: int
    memory_gib: float
    tiny: bool
    checkpoint: str | None
    data: Path | None
    download: bool
    old_libraries: str | None
    flash: bool
    frames: int

    @property
    def kernels(self) -> tuple[str, ...]:
        """Attention kernels to compare, those of transformers' names."""
        return ("sdpa", "flash_attention_2") if self.flash else ("sdpa",)

    @property
    def identity(self) -> dict[str, str | None]:
        """What a step's result depends on, as it is written beside it."""
        own = asdict(self).items()
        return {
            **{name: None if value is None else str(value) for name, value in own},
            **{name: version(name) for name in ("torch", "transformers", "infthor-eval")},
        }

    def continues(self, earlier: Mapping[str, str | None]) -> bool:
        """Return whether what is done under an earlier identity need not be done again.

        Data or libraries that were not there then are for the steps that needed them.
        """
        own = self.identity
        given = [name for name in _FOR_SOME if name in earlier and earlier[name] is None]
        return {**own, **dict.fromkeys(given)} == earlier


def find_machine(
    *,
    device: str,
    tiny: bool,
    checkpoint: Path | None,
    data: Path | None,
    download: bool,
    old_libraries: str | None,
    frames: int,
) -> Machine:
    """Look at the machine; `checkpoint` and `data` are folders, looked for where None, and `frames`
    those of the long trajectory."""
    on_gpu = device == "cuda"
    properties = torch.cuda.get_device_properties(0) if on_gpu else None
    weights = str(checkpoint) if checkpoint else _cached(download)
    folder = data or default_folder()
    return Machine(
        device=device,
        name=properties.name if properties else "a CPU",
        gpus=torch.cuda.device_count() if on_gpu else 0,
        memory_gib=properties.total_memory / 2**30 if properties else 0.0,
        tiny=tiny,
        checkpoint=None if tiny else weights,
        data=folder if not tiny and (download or (folder / "metadata").is_dir()) else None,
        download=download,
        old_libraries=old_libraries,
        flash=on_gpu and importlib.util.find_spec("flash_attn") is not None,
        frames=_TINY_FRAMES if tiny else frames,
    )


def _cached(download: bool) -> str | None:
    """Return the weights in the hub's cache, or their name if they may be downloaded."""
    from huggingface_hub import snapshot_download
    from huggingface_hub.errors import LocalEntryNotFoundError

    try:
        return snapshot_download(CHECKPOINT, local_files_only=True)
    except LocalEntryNotFoundError:
        return CHECKPOINT if download else None
