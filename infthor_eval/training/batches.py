"""Sequences as tensors that a model is trained on."""

from collections.abc import Sequence
from typing import TypedDict

import torch
from torch.nn.utils.rnn import pad_sequence

from infthor_eval.errors import DataError
from infthor_eval.training.encoding import TrainingSequence
from model_adapters.hf.family import Family
from model_adapters.hf.prompt import Frame, token_ids

__all__ = ["IGNORED", "Batch", "collate", "n_labels"]

IGNORED = -100  # the label of a token that no loss is taken on, as PyTorch's cross entropy has it


class Batch(TypedDict):
    """What `SequenceModel` is called with, by the names of its arguments. All tensors are on the CPU.

    Attributes:
        input_ids: (batch, tokens), frames expanded, padded at the end.
        position_ids: (batch, tokens), or (3, batch, tokens) where positions have three axes.
        attention_mask: (batch, tokens), 0 where there is padding; None where there is none, so that attention can take
            kernels that know the causal mask without reading one.
        labels: (batch, tokens), the token itself where loss is taken on it, else -100.
        slots: (batch, tokens), bool, where the features of frames go.
        frames: of the whole batch, in the order of their slots.
    """

    input_ids: torch.Tensor
    position_ids: torch.Tensor
    attention_mask: torch.Tensor | None
    labels: torch.Tensor
    slots: torch.Tensor
    frames: list[Frame]


def collate(sequences: Sequence[TrainingSequence], family: Family, pad_id: int) -> Batch:
    """Lay sequences out side by side.

    Args:
        sequences: at least one.
        family: of the model that is trained.
        pad_id: what shorter sequences are filled up with.

    Raises:
        DataError: a sequence has no token that loss could be taken on; the first token is none, as nothing predicts it.
    """
    ids = [torch.tensor(list(token_ids(sequence.pieces))) for sequence in sequences]
    labels = [_labels(sequence, own) for sequence, own in zip(sequences, ids, strict=True)]
    masks = pad_sequence([torch.ones_like(own) for own in ids], batch_first=True)
    return Batch(
        input_ids=pad_sequence(ids, batch_first=True, padding_value=pad_id),
        position_ids=_positions(sequences, ids, family),
        attention_mask=None if bool(masks.all()) else masks,
        labels=pad_sequence(labels, batch_first=True, padding_value=IGNORED),
        slots=pad_sequence([_slots(sequence, family.slot_id) for sequence in sequences], batch_first=True),
        frames=[frame for sequence in sequences for frame in sequence.frames],
    )


def n_labels(batch: Batch) -> int:
    """How many tokens of a batch loss is taken on."""
    return int((batch["labels"] != IGNORED).sum())


def _labels(sequence: TrainingSequence, ids: torch.Tensor) -> torch.Tensor:
    trained: list[bool] = []
    for piece, learned in zip(sequence.pieces, sequence.trained, strict=True):
        trained.extend([learned] if isinstance(piece, int) else [False] * len(piece.ids))
    chosen = torch.tensor(trained)
    chosen[0] = False
    if not chosen.any():
        raise DataError(f"{sequence.name}: there is no token to take loss on; leave the sequence out")
    return ids.where(chosen, IGNORED)


def _positions(sequences: Sequence[TrainingSequence], ids: Sequence[torch.Tensor], family: Family) -> torch.Tensor:
    """Of whole sequences, each counted from 0; padding stands at position 0, where it stretches no scaled RoPE."""
    rows = [
        family.positions(own, [frame.size for frame in sequence.frames], 0)
        for sequence, own in zip(sequences, ids, strict=True)
    ]
    longest = max(len(own) for own in ids)
    return torch.cat([torch.nn.functional.pad(row, (0, longest - row.shape[-1])) for row in rows], dim=-2)


def _slots(sequence: TrainingSequence, slot_id: int) -> torch.Tensor:
    slots: list[bool] = []
    for piece in sequence.pieces:
        slots.extend([False] if isinstance(piece, int) else [token == slot_id for token in piece.ids])
    return torch.tensor(slots)
