"""Batches of sequences as tensors."""

from collections.abc import Sequence
from typing import TypedDict

import torch
from torch.nn.utils.rnn import pad_sequence

from infthor_eval.errors import DataError
from infthor_eval.training.encoding import TrainingSequence
from model_adapters.hf.family import Family
from model_adapters.hf.prompting.prompt import Frame, token_ids

IGNORED = -100  # label of tokens without loss, in PyTorch's cross entropy


class Batch(TypedDict):
    """Arguments of `SequenceModel`. All tensors are on the CPU.

    Attributes:
        input_ids: token ids, (batch, tokens), frames expanded, padded at the end.
        position_ids: position ids, (batch, tokens), or (3, batch, tokens) for positions with three
            axes.
        attention_mask: 0 for padding and 1 for tokens, (batch, tokens). None without padding,
            because attention kernels with a built-in causal mask are faster than those that read
            one.
        labels: the token where loss is computed on it, else -100, (batch, tokens).
        slots: true for slots of frames' features, (batch, tokens).
        frames: frames of the whole batch, in the order of their slots.
    """

    input_ids: torch.Tensor
    position_ids: torch.Tensor
    attention_mask: torch.Tensor | None
    labels: torch.Tensor
    slots: torch.Tensor
    frames: list[Frame]


def collate(sequences: Sequence[TrainingSequence], family: Family, pad_id: int) -> Batch:
    """Combine one or more sequences to a batch."""
    ids = [torch.tensor(list(token_ids(sequence.pieces))) for sequence in sequences]
    labels = [_labels(sequence, own) for sequence, own in zip(sequences, ids, strict=True)]
    return Batch(
        input_ids=pad_sequence(ids, batch_first=True, padding_value=pad_id),
        position_ids=_positions(sequences, ids, family),
        attention_mask=_attention_mask(ids),
        labels=pad_sequence(labels, batch_first=True, padding_value=IGNORED),
        slots=pad_sequence(
            [_slots(sequence, family.slot_id) for sequence in sequences], batch_first=True
        ),
        frames=[frame for sequence in sequences for frame in sequence.frames],
    )


def n_labels(batch: Batch) -> int:
    """Return the number of tokens of a batch with loss."""
    return int((batch["labels"] != IGNORED).sum())


def _attention_mask(ids: Sequence[torch.Tensor]) -> torch.Tensor | None:
    masks = pad_sequence([torch.ones_like(own) for own in ids], batch_first=True)
    return None if bool(masks.all()) else masks


def _labels(sequence: TrainingSequence, ids: torch.Tensor) -> torch.Tensor:
    flags: list[bool] = []
    for piece, has_loss in zip(sequence.pieces, sequence.has_loss, strict=True):
        flags.extend([has_loss] if isinstance(piece, int) else [False] * len(piece.ids))
    mask = torch.tensor(flags)
    mask[0] = False
    if not mask.any():
        raise DataError(f"{sequence.name}: no token has loss; leave the sequence out")
    return ids.where(mask, IGNORED)


def _positions(
    sequences: Sequence[TrainingSequence], ids: Sequence[torch.Tensor], family: Family
) -> torch.Tensor:
    return pad_positions(
        [
            family.positions(own, [frame.size for frame in sequence.frames], 0)
            for sequence, own in zip(sequences, ids, strict=True)
        ]
    )


def pad_positions(rows: Sequence[torch.Tensor]) -> torch.Tensor:
    """Return the positions of sequences, each from 0; padding has 0, which never lengthens RoPE."""
    longest = max(row.shape[-1] for row in rows)
    padded = [torch.nn.functional.pad(row, (0, longest - row.shape[-1])) for row in rows]
    return torch.cat(padded, dim=-2)


def _slots(sequence: TrainingSequence, slot_id: int) -> torch.Tensor:
    slots: list[bool] = []
    for piece in sequence.pieces:
        slots.extend(
            [False] if isinstance(piece, int) else [token == slot_id for token in piece.ids]
        )
    return torch.tensor(slots)
