"""A vision-language model of any family as a network from sequences to their loss."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import torch
from torch import Tensor
from torch.nn import Parameter
from torch.nn.functional import cross_entropy, pad
from torch.utils.checkpoint import checkpoint

from infthor_eval.errors import ModelError, UsageError, unknown_name
from infthor_eval.training.batches import IGNORED
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.prompt import Frame

PARTS = ("vision", "embeddings", "decoder", "head")
# Frames in the vision tower at once; 1,000 frames would need more memory than the decoder.
_FRAME_BATCH = 32
_LOGIT_ROWS = 1024  # rows of logits at once; each has as many values as the vocabulary


class SequenceModel(torch.nn.Module):
    """The loss of sequences of text and frames.

    The parts of the transformers model are called one by one: features of frames, embeddings,
    decoder, output head. So all families are trained by the same code, logits are computed only
    where there are labels, and a sequence can be split between embedding and decoding.

    Args:
        loaded: the checkpoint.

    Attributes:
        model: the transformers model, which is saved by `save_pretrained`.
        family: family of the model.
    """

    # Tells transformers' Trainer that the loss is a sum over tokens divided by
    # `num_items_in_batch`.
    accepts_loss_kwargs = True

    def __init__(self, loaded: LoadedCheckpoint) -> None:
        super().__init__()
        self.model: Any = loaded.model
        self.family = loaded.family

    @property
    def decoder(self) -> Any:
        """The language model without its output head."""
        return self.model.get_decoder()

    @property
    def device(self) -> torch.device:
        """Device of the embeddings and of the decoder's inputs."""
        return self.model.get_input_embeddings().weight.device

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
        """Return the loss of a `Batch`; all arguments but the last are its fields.

        Args:
            num_items_in_batch: divisor of the sum of the tokens' losses; the labels of this batch
                where None.

        Returns:
            "loss": cross entropy in nats, a float32 scalar.
        """
        embeds = self.embed(input_ids, slots, self.features(frames))
        hidden = self.decode(embeds, position_ids, attention_mask)
        targets = next_labels(labels)
        n_items = (targets != IGNORED).sum() if num_items_in_batch is None else num_items_in_batch
        total = self.loss_sum(hidden, targets)
        return {"loss": total / torch.as_tensor(n_items, device=total.device)}

    def features(self, frames: Sequence[Frame]) -> list[Tensor]:
        """Return the features of each frame, (slots, hidden); repeated frames are computed once."""
        distinct = list(dict.fromkeys(frames))
        computed: list[Tensor] = []
        with torch.set_grad_enabled(torch.is_grad_enabled() and self.trains_vision):
            for first in range(0, len(distinct), _FRAME_BATCH):
                images = [frame.ref.load() for frame in distinct[first : first + _FRAME_BATCH]]
                computed.extend(self.family.features(images))
        for frame, features in zip(distinct, computed, strict=True):
            if len(features) != self.n_slots(frame):
                raise ModelError(
                    f"the processor makes {self.n_slots(frame)} image tokens of a frame and the "
                    f"model {len(features)} features; they do not belong to one checkpoint"
                )
        by_frame = dict(zip(distinct, computed, strict=True))
        return [by_frame[frame] for frame in frames]

    def n_slots(self, frame: Frame) -> int:
        """Return the number of a frame's features."""
        return frame.ids.count(self.family.slot_id)

    @property
    def trains_vision(self) -> bool:
        """True if the vision tower or the projector is trained."""
        return any(parameter.requires_grad for parameter in parameters_by_part(self)["vision"])

    def embed(self, input_ids: Tensor, slots: Tensor, features: Sequence[Tensor]) -> Tensor:
        """Return the inputs of the decoder, (batch, tokens, hidden).

        Args:
            input_ids: token ids, (batch, tokens).
            slots: true for slots of features, (batch, tokens).
            features: features in the order of their slots, (slots, hidden) when concatenated.
        """
        embeds: Tensor = self.model.get_input_embeddings()(input_ids.to(self.device))
        if not features:
            return embeds
        return embeds.masked_scatter(
            slots[..., None].to(self.device), torch.cat(list(features)).to(embeds)
        )

    def decode(self, embeds: Tensor, position_ids: Tensor, attention_mask: Tensor | None) -> Tensor:
        """Return the decoder's last hidden states, (batch, tokens, hidden)."""
        output = self.decoder(
            inputs_embeds=embeds,
            position_ids=position_ids.to(self.device),
            attention_mask=None if attention_mask is None else attention_mask.to(self.device),
            use_cache=False,
        )
        return output.last_hidden_state

    def loss_sum(self, hidden: Tensor, targets: Tensor) -> Tensor:
        """Return the sum of the cross entropies of all tokens with a target: nats, float32 scalar.

        Logits are computed only for targets and in chunks, which are recomputed for the gradient:
        all logits of a long sequence would need more memory than the model.

        Args:
            hidden: hidden states, (batch, tokens, hidden).
            targets: token that each token should predict, or -100, (batch, tokens).
        """
        targets = targets.to(hidden.device)
        has_target = targets != IGNORED
        total = hidden.new_zeros((), dtype=torch.float32)
        # Without targets there is still one, empty, chunk: every rank of a split sequence needs a
        # backward pass.
        chunks = (values[has_target].split(_LOGIT_ROWS) for values in (hidden, targets))
        for states, chunk_targets in zip(*chunks, strict=True):
            total = total + checkpoint(
                self._cross_entropy, states, chunk_targets, use_reentrant=False
            )
        return total

    def _cross_entropy(self, states: Tensor, targets: Tensor) -> Tensor:
        logits = self.model.get_output_embeddings()(states)
        return cross_entropy(logits.float(), targets, reduction="sum")

    def gradient_checkpointing_enable(
        self, gradient_checkpointing_kwargs: Mapping[str, Any] | None = None, **settings: Any
    ) -> None:
        """Keep each layer's inputs alone and recompute the rest for the gradient, in training mode.

        Args:
            gradient_checkpointing_kwargs: arguments of `torch.utils.checkpoint.checkpoint`;
                `use_reentrant` is always False.
            settings: further arguments of the transformers model's method of this name.
        """
        kwargs = {**(gradient_checkpointing_kwargs or {}), "use_reentrant": False}
        self.model.gradient_checkpointing_enable(gradient_checkpointing_kwargs=kwargs, **settings)
        # transformers lets embeddings require gradients, which only reentrant checkpoints need:
        # gradients of frozen embeddings and of the vision tower would be computed for nothing.
        self.model.disable_input_require_grads()

    def gradient_checkpointing_disable(self) -> None:
        """Keep all activations again."""
        self.model.gradient_checkpointing_disable()


def next_labels(labels: Tensor) -> Tensor:
    """Return the target of each token, which is the label of the next one, (batch, tokens)."""
    return pad(labels[:, 1:], (0, 1), value=IGNORED)


def parameters_by_part(model: SequenceModel) -> dict[str, list[Parameter]]:
    """Return a model's parameters by the names of `PARTS`.

    "vision" is everything outside the language model: the tower and the projector. A head that is
    tied to the embeddings is in both parts.
    """
    embeddings = list(model.model.get_input_embeddings().parameters())
    head = list(model.model.get_output_embeddings().parameters())
    in_embeddings = set(map(id, embeddings))
    decoder = [
        parameter for parameter in model.decoder.parameters() if id(parameter) not in in_embeddings
    ]
    language = in_embeddings | set(map(id, decoder)) | set(map(id, head))
    vision = [parameter for parameter in model.model.parameters() if id(parameter) not in language]
    return {"vision": vision, "embeddings": embeddings, "decoder": decoder, "head": head}


def freeze(model: SequenceModel, parts: Collection[str]) -> None:
    """Freeze parts of a model.

    Args:
        model: the model.
        parts: names of `PARTS`.
    """
    for name in parts:
        if name not in PARTS:
            raise unknown_name("part of a model", name, PARTS)
    by_part = parameters_by_part(model)
    shared = set(map(id, by_part["embeddings"])) & set(map(id, by_part["head"]))
    if shared and ("embeddings" in parts) != ("head" in parts):
        raise UsageError(
            "embeddings and head are the same weights in this model; freeze both of them or neither"
        )
    for name in parts:
        for parameter in by_part[name]:
            parameter.requires_grad_(False)
    if not any(parameter.requires_grad for parameter in model.parameters()):
        raise UsageError(f"nothing is left to train; freeze fewer of {', '.join(PARTS)}")
