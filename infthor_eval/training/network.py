"""A vision-language model as a network from sequences to their loss, whatever its family."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import torch
from torch import Tensor
from torch.nn import Parameter
from torch.nn.functional import cross_entropy, pad
from torch.utils.checkpoint import checkpoint

from infthor_eval.errors import ModelError, UsageError, unknown_name
from infthor_eval.training.batches import IGNORED
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.prompt import Frame

__all__ = ["PARTS", "SequenceModel", "decay_groups", "freeze", "next_labels", "parameters_by_part"]

PARTS = ("vision", "embeddings", "decoder", "head")
_FRAMES_AT_ONCE = (
    32  # in the vision tower: a window of 1,000 frames would take more memory there than the decoder takes
)
_LOGITS_AT_ONCE = 1024  # rows; one has as many values as the vocabulary


class SequenceModel(torch.nn.Module):
    """The loss of sequences of text and frames.

    The transformers model in it runs by its parts: features of frames, embeddings, decoder, output head. So every
    family is trained by the same code, logits are made only where a label is, and a sequence can be cut between
    embedding and decoding.

    Args:
        loaded: the checkpoint.

    Attributes:
        model: its transformers model, to be saved by `save_pretrained`.
        family: how its frames become features and positions.

    Raises:
        UsageError: the frequencies of its rotary positions depend on a sequence's length.
    """

    # transformers' Trainer asks for it: the loss is a sum over tokens, divided by what `num_items_in_batch` says.
    accepts_loss_kwargs = True

    def __init__(self, loaded: Loaded) -> None:
        super().__init__()
        self.model: Any = loaded.model
        self.family = loaded.family
        _require_fixed_rope(self.decoder)

    @property
    def decoder(self) -> Any:
        """The language model without its output head."""
        return self.model.get_decoder()

    @property
    def device(self) -> torch.device:
        """Where embeddings are, and what goes into the decoder."""
        device: torch.device = self.model.get_input_embeddings().weight.device
        return device

    def forward(
        self,
        input_ids: Tensor,
        position_ids: Tensor,
        attention_mask: Tensor | None,
        labels: Tensor,
        slots: Tensor,
        frames: Sequence[Frame],
        num_items_in_batch: Tensor | int | None = None,
    ) -> dict[str, Tensor]:
        """The loss of a `Batch`, whose fields the arguments are.

        Args:
            input_ids: (batch, tokens).
            position_ids: (batch, tokens) or (3, batch, tokens).
            attention_mask: (batch, tokens) or None.
            labels: (batch, tokens).
            slots: (batch, tokens).
            frames: in the order of their slots.
            num_items_in_batch: what the sum of the tokens' losses is divided by; the labels of this batch where None.

        Returns:
            "loss": cross entropy in nats, a float32 scalar.

        Raises:
            DataError: a frame cannot be read.
            ModelError: processor and model disagree on how many tokens a frame takes.
        """
        embeds = self.embed(input_ids, slots, self.features(frames))
        hidden = self.decode(embeds, position_ids, attention_mask)
        targets = next_labels(labels)
        n_items = (targets != IGNORED).sum() if num_items_in_batch is None else num_items_in_batch
        total = self.loss_sum(hidden, targets)
        return {"loss": total / torch.as_tensor(n_items, device=total.device)}

    def features(self, frames: Sequence[Frame]) -> list[Tensor]:
        """Features of each frame, (slots, hidden); a frame that stands several times is computed once.

        Raises:
            DataError: a frame cannot be read.
            ModelError: processor and model disagree on how many tokens a frame takes.
        """
        distinct = list(dict.fromkeys(frames))
        made: list[Tensor] = []
        with torch.set_grad_enabled(torch.is_grad_enabled() and self.trains_vision):
            for first in range(0, len(distinct), _FRAMES_AT_ONCE):
                images = [frame.ref.load() for frame in distinct[first : first + _FRAMES_AT_ONCE]]
                made.extend(self.family.features(images))
        for frame, features in zip(distinct, made, strict=True):
            if len(features) != self.n_slots(frame):
                raise ModelError(
                    f"the processor makes {self.n_slots(frame)} image tokens of a frame and the model {len(features)} "
                    "features; they do not belong to one checkpoint"
                )
        by_frame = dict(zip(distinct, made, strict=True))
        return [by_frame[frame] for frame in frames]

    def n_slots(self, frame: Frame) -> int:
        """How many features a frame has."""
        return frame.ids.count(self.family.slot_id)

    @property
    def trains_vision(self) -> bool:
        """Whether anything that features pass through is trained."""
        return any(parameter.requires_grad for parameter in parameters_by_part(self)["vision"])

    def embed(self, input_ids: Tensor, slots: Tensor, features: Sequence[Tensor]) -> Tensor:
        """What the decoder is fed, (batch, tokens, hidden).

        Args:
            input_ids: (batch, tokens).
            slots: (batch, tokens).
            features: rows for the slots, in their order; in as many pieces as one likes.
        """
        embeds: Tensor = self.model.get_input_embeddings()(input_ids.to(self.device))
        if not features:
            return embeds
        return embeds.masked_scatter(slots[..., None].to(self.device), torch.cat(list(features)).to(embeds))

    def decode(self, embeds: Tensor, position_ids: Tensor, attention_mask: Tensor | None) -> Tensor:
        """The decoder's last hidden states, (batch, tokens, hidden)."""
        output = self.decoder(
            inputs_embeds=embeds,
            position_ids=position_ids.to(self.device),
            attention_mask=None if attention_mask is None else attention_mask.to(self.device),
            use_cache=False,
        )
        hidden: Tensor = output.last_hidden_state
        return hidden

    def loss_sum(self, hidden: Tensor, targets: Tensor) -> Tensor:
        """Sum of the cross entropies of the tokens that have a target, in nats; a float32 scalar.

        Logits exist only where a target is, and only some of them at a time: they are made again for the gradient.

        Args:
            hidden: (batch, tokens, hidden).
            targets: (batch, tokens), what each token should predict, or -100.
        """
        targets = targets.to(hidden.device)
        chosen = targets != IGNORED
        total = hidden.new_zeros((), dtype=torch.float32)
        # Without any target there is still one, empty, chunk: ranks of a cut sequence all need a gradient to pass on.
        for states, wanted in zip(
            hidden[chosen].split(_LOGITS_AT_ONCE), targets[chosen].split(_LOGITS_AT_ONCE), strict=True
        ):
            total = total + checkpoint(self._cross_entropy, states, wanted, use_reentrant=False)
        return total

    def _cross_entropy(self, states: Tensor, wanted: Tensor) -> Tensor:
        logits = self.model.get_output_embeddings()(states)
        return cross_entropy(logits.float(), wanted, reduction="sum")

    def gradient_checkpointing_enable(
        self, gradient_checkpointing_kwargs: Mapping[str, Any] | None = None, **settings: Any
    ) -> None:
        """Keep only the inputs of each layer and compute it again for the gradient; effective in training mode.

        Args:
            gradient_checkpointing_kwargs: of `torch.utils.checkpoint.checkpoint`; `use_reentrant` is always False.
            settings: further ones of the transformers model's method of this name.
        """
        kwargs = {**(gradient_checkpointing_kwargs or {}), "use_reentrant": False}
        self.model.gradient_checkpointing_enable(gradient_checkpointing_kwargs=kwargs, **settings)
        # transformers makes embeddings want gradients, which only reentrant checkpoints need: gradients of frozen
        # embeddings, and of the vision tower's activations, would be computed for nobody.
        self.model.disable_input_require_grads()

    def gradient_checkpointing_disable(self) -> None:
        """Keep all activations again."""
        self.model.gradient_checkpointing_disable()


def next_labels(labels: Tensor) -> Tensor:
    """What each token should predict: the label of the one behind it; (batch, tokens) like the labels."""
    return pad(labels[:, 1:], (0, 1), value=IGNORED)


def parameters_by_part(model: SequenceModel) -> dict[str, list[Parameter]]:
    """A model's parameters by the names of PARTS.

    "vision" is everything outside the language model: the tower and what projects its features. A head that is tied to
    the embeddings is in both parts.
    """
    embeddings = list(model.model.get_input_embeddings().parameters())
    head = list(model.model.get_output_embeddings().parameters())
    in_embeddings = set(map(id, embeddings))
    decoder = [parameter for parameter in model.decoder.parameters() if id(parameter) not in in_embeddings]
    language = in_embeddings | set(map(id, decoder)) | set(map(id, head))
    vision = [parameter for parameter in model.model.parameters() if id(parameter) not in language]
    return {"vision": vision, "embeddings": embeddings, "decoder": decoder, "head": head}


def decay_groups(parameters: Sequence[Parameter], weight_decay: float) -> list[dict[str, Any]]:
    """Parameters as an optimizer takes them: matrices decay, biases and norms do not."""
    groups = [
        {"params": [one for one in parameters if one.ndim > 1], "weight_decay": weight_decay},
        {"params": [one for one in parameters if one.ndim <= 1], "weight_decay": 0.0},
    ]
    return [group for group in groups if group["params"]]


def freeze(model: SequenceModel, parts: Collection[str]) -> None:
    """Leave parts of a model as they are in training; the others are not touched.

    Args:
        model: the model.
        parts: names of PARTS.

    Raises:
        UsageError: there is no such part, one of two parts that share their weights would be frozen without the other,
            or nothing would be left to train.
    """
    for name in parts:
        if name not in PARTS:
            raise unknown_name("part of a model", name, PARTS)
    by_part = parameters_by_part(model)
    shared = set(map(id, by_part["embeddings"])) & set(map(id, by_part["head"]))
    if shared and ("embeddings" in parts) != ("head" in parts):
        raise UsageError("embeddings and head are the same weights in this model; freeze both of them or neither")
    for name in parts:
        for parameter in by_part[name]:
            parameter.requires_grad_(False)
    if not any(parameter.requires_grad for parameter in model.parameters()):
        raise UsageError(f"nothing is left to train; freeze fewer of {', '.join(PARTS)}")


def _require_fixed_rope(decoder: Any) -> None:
    rope_type = (getattr(decoder.config, "rope_parameters", None) or {}).get("rope_type")
    if rope_type in ("dynamic", "longrope"):
        # Its frequencies would be those of whatever was run last, or on each rank those of its own share.
        raise UsageError(f"a model with rope={rope_type} cannot be trained; take linear or yarn, or no extension")
