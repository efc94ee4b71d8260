"""States from which a training run resumes exactly."""

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import load_model, save_model

from infthor_eval.errors import UsageError, wrap_errors
from infthor_eval.storage.files import prepare_folder, write_atomically

_WEIGHTS = "model.safetensors"
_OPTIMIZER = "optimizer.pt"
_STATE = "state.json"
_HINT = "restore it, or remove the folder to restart"


@dataclass(frozen=True)
class Checkpoints:
    """The last state of a run, in `step-NUMBER`: weights, optimizers' moments, and settings.

    Nothing else is stored: order of sequences, learning rate and random numbers follow from
    settings and step.

    Attributes:
        folder: folder of the run.
        about: settings that have to be equal for resuming, as JSON values.
    """

    folder: Path
    about: Mapping[str, Any]

    def save(self, step: int, model: torch.nn.Module, *optimizers: torch.optim.Optimizer) -> None:
        """Write the state after some finished steps, then remove the previous one."""
        path = prepare_folder(self.folder) / f"step-{step:06d}"
        with (
            wrap_errors(
                f"{path}: cannot be written", "free some space; the last checkpoint is still there"
            ),
            write_atomically(path) as folder,
        ):
            folder.mkdir()
            save_model(model, str(folder / _WEIGHTS))
            torch.save([one.state_dict() for one in optimizers], folder / _OPTIMIZER)
            state = {"step": step, "about": self.about}
            (folder / _STATE).write_text(json.dumps(state, indent=2) + "\n", encoding="utf-8")
        for older in self._places():
            if older != path:
                shutil.rmtree(older)

    def restore(self, model: torch.nn.Module, *optimizers: torch.optim.Optimizer) -> int:
        """Load the last state, if there is one, and return the number of finished steps."""
        places = self._places()
        if not places:
            return 0
        last = places[-1]
        with wrap_errors(f"{last}: cannot be read", _HINT, catch=Exception):
            state = json.loads((last / _STATE).read_text(encoding="utf-8"))
            step = int(state["step"])
            about = dict(state["about"])
        self._require_same(last, about)
        with wrap_errors(f"{last}: cannot be read", _HINT, catch=Exception):
            load_model(model, last / _WEIGHTS)
            device = next(model.parameters()).device
            states = torch.load(last / _OPTIMIZER, map_location=device, weights_only=True)
            for optimizer, of_optimizer in zip(optimizers, states, strict=True):
                optimizer.load_state_dict(of_optimizer)
        return step

    def _places(self) -> list[Path]:
        return sorted(self.folder.glob("step-*"), key=_number) if self.folder.is_dir() else []

    def _require_same(self, last: Path, about: Mapping[str, Any]) -> None:
        for name in sorted({*self.about, *about}):
            if self.about.get(name) != about.get(name):
                raise UsageError(
                    f"{last}: is of a run with {name}={about.get(name)}, not "
                    f"{self.about.get(name)}; use its settings, or give another folder"
                )


def _number(path: Path) -> int:
    with wrap_errors(f"{path}: not a checkpoint", "remove it", catch=ValueError):
        return int(path.name.removeprefix("step-"))
