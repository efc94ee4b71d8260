"""The decoder as it learns to read: losses of answers, and of what happened between frames."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor
from torch.nn import Parameter
from torch.nn.functional import binary_cross_entropy_with_logits, gelu

from infthor_eval.training.batches import Batch
from infthor_eval.training.network import SequenceModel, next_labels
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.prompt import Frame
from recipes.nano.reading.events import Event
from recipes.nano.reading.frame_units import FrameUnits
from recipes.nano.seeing.units import Units

_EVENT_LAYER = 2  # layers before the loss of events: those after it can use what it asks for
_EVENT_BIAS = -4.0  # at first: hardly anything happens

FrameEvents = Sequence[Sequence[tuple[Event, str]] | None]
"""What happened before each frame of a sequence since the one before it, None if that is far."""


class ReadingNetwork(SequenceModel):
    """A `SequenceModel` whose frames are known by their units.

    Args:
        loaded: the model.
        frames: units of all frames.
        units: their names.

    Attributes:
        frames: units that frames are known by from now on.
        norm: normalises states for the next layer.
        events: reads off what happened between frames; it is not part of the model.
    """

    def __init__(self, loaded: LoadedCheckpoint, frames: FrameUnits, units: Units) -> None:
        super().__init__(loaded)
        self.frames = frames
        self._units = units
        self._frame_end: int = loaded.model.config.vision_end_token_id
        hidden = loaded.model.config.text_config.hidden_size
        self.norm = torch.nn.LayerNorm(hidden)
        self.events = torch.nn.Linear(hidden, len(Event) * len(units.types))
        torch.nn.init.constant_(self.events.bias, _EVENT_BIAS)

    def features(self, frames: Sequence[Frame]) -> list[Tensor]:
        """Return the features of each frame, (slots, hidden)."""
        if not frames:
            return []
        values = torch.stack([self.frames.of(frame) for frame in frames])
        layer = self._merger_layer
        on = gelu(values.flatten(2))
        features = torch.nn.functional.linear(on, layer.weight[:, : len(self._units)], layer.bias)
        return [*features]

    @property
    def _merger_layer(self) -> Any:
        return self.model.model.visual.merger.mlp[2]

    def trained_parameters(self) -> list[Parameter]:
        """Return the parameters of all but the tower; its merger's last layer is among them."""
        frozen = {*map(id, self.model.model.visual.parameters())} - {
            *map(id, self._merger_layer.parameters())
        }
        return [parameter for parameter in self.parameters() if id(parameter) not in frozen]

    def losses(self, batch: Batch, events: Sequence[FrameEvents]) -> tuple[Tensor, Tensor]:
        """Return the sums of the losses of all tokens with a label, and of what happened.

        Args:
            batch: a batch.
            events: what happened in each of its sequences.
        """
        embeds = self.embed(batch["input_ids"], batch["slots"], self.features(batch["frames"]))
        output = self.decoder(
            inputs_embeds=embeds,
            position_ids=batch["position_ids"],
            attention_mask=batch["attention_mask"],
            use_cache=False,
            output_hidden_states=True,
        )
        answers = self.loss_sum(output.last_hidden_state, next_labels(batch["labels"]))
        ends = batch["input_ids"] == self._frame_end
        return answers, self._event_loss(output.hidden_states[_EVENT_LAYER][ends], events)

    def _event_loss(self, states: Tensor, events: Sequence[FrameEvents]) -> Tensor:
        """Return the loss of what happened before each frame's end, (frames, hidden)."""
        flat = [of_frame for of_sequence in events for of_frame in of_sequence]
        known = [at for at, of_frame in enumerate(flat) if of_frame is not None]
        labels = torch.zeros(len(known), len(Event), len(self._units.types))
        for row, at in enumerate(known):
            for event, name in flat[at] or ():
                column = self._units.index(name)
                if column >= 0:
                    labels[row, event, column] = 1.0
        logits = self.events(self.norm(states[known]))
        return binary_cross_entropy_with_logits(logits, labels.flatten(1), reduction="sum")
