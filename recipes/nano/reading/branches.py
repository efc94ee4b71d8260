"""Sequences that begin alike as one, which has the beginning once.

Its loss is the sum of theirs, at the price of one context: frames take most of the tokens of each
question on them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import torch
from torch.nn.utils.rnn import pad_sequence

from infthor_eval.training.batches import Batch, collate, pad_positions
from infthor_eval.training.encoding import TrainingSequence
from model_adapters.hf.family import Family
from model_adapters.hf.prompting.prompt import Frame, n_tokens, token_ids


@dataclass(frozen=True)
class BranchedSequence(TrainingSequence):
    """A sequence that ends in several branches.

    Attributes:
        branches: numbers of pieces of its branches: each of them follows what is before the first
            one, and sees none of the others.
    """

    branches: tuple[int, ...]

    @property
    def spans(self) -> list[slice]:
        """Places of the pieces before all branches, and of each branch."""
        ends = list(accumulate(self.branches, initial=len(self.pieces) - sum(self.branches)))
        return [slice(start, end) for start, end in pairwise([0, *ends])]

    @property
    def span_sizes(self) -> list[int]:
        """Tokens before all branches, and of each branch."""
        return [n_tokens(self.pieces[span]) for span in self.spans]


def with_branches(
    name: str, head: TrainingSequence, tails: Sequence[TrainingSequence]
) -> BranchedSequence:
    """Return a sequence that goes on in several ways, given what is before them and each of them.

    Args:
        name: source of the sequence.
        head: what all of them follow.
        tails: the branches.
    """
    return BranchedSequence(
        name,
        (*head.pieces, *(piece for tail in tails for piece in tail.pieces)),
        (*head.has_loss, *(flag for tail in tails for flag in tail.has_loss)),
        tuple(len(tail.pieces) for tail in tails),
    )


def collate_branched(sequences: Sequence[BranchedSequence], family: Family, pad_id: int) -> Batch:
    """Combine one or more sequences to a batch.

    Its attention mask is true where a token sees another, (batch, 1, tokens, tokens).
    """
    batch = collate(sequences, family, pad_id)
    batch["attention_mask"] = _seen(sequences)
    batch["position_ids"] = pad_positions([_positions(sequence, family) for sequence in sequences])
    return batch


def _seen(sequences: Sequence[BranchedSequence]) -> torch.Tensor:
    numbers = [
        torch.arange(len(sequence.span_sizes)).repeat_interleave(torch.tensor(sequence.span_sizes))
        for sequence in sequences
    ]
    spans = pad_sequence(numbers, batch_first=True, padding_value=-1)
    of_query, of_key = spans[:, :, None], spans[:, None, :]
    # A row that sees nothing has no softmax; padding sees other padding.
    return ((of_key == 0) | (of_key == of_query)).tril()[:, None]


def _positions(sequence: BranchedSequence, family: Family) -> torch.Tensor:
    """Return the positions of a sequence; each branch goes on where what is before all ends."""
    ids = torch.tensor(list(token_ids(sequence.pieces)))
    parts: list[torch.Tensor] = []
    for span, own in zip(sequence.spans, ids.split(sequence.span_sizes), strict=True):
        sizes = [piece.size for piece in sequence.pieces[span] if isinstance(piece, Frame)]
        start = int(parts[0].max()) + 1 if parts else 0
        parts.append(family.positions(own, sizes, start))
    return torch.cat(parts, dim=-1)
