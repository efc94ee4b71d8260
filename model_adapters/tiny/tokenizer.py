"""Byte-level BPE tokenizers trained on the spot, so that tiny models need no download."""

from collections.abc import Sequence

from tokenizers import Regex, Tokenizer, decoders, models, normalizers, pre_tokenizers, trainers
from transformers import PreTrainedTokenizerFast

from model_adapters.tiny.corpus import CORPUS

__all__ = ["train_tokenizer"]

# Letters, single digits, punctuation and white space apart: how current byte-level tokenizers cut text.
_SPLIT = r"""[^\r\n\p{L}\p{N}]?\p{L}+|\p{N}| ?[^\s\p{L}\p{N}]+[\r\n]*|\s*[\r\n]+|\s+(?!\S)|\s+"""


def train_tokenizer(special: Sequence[str], end: str, pad: str, n_merged: int = 600) -> PreTrainedTokenizerFast:
    """Train a tokenizer on the package's corpus.

    Args:
        special: special tokens, which take the ids behind the trained ones in this order; `end` and `pad` are among
            them.
        end: the token that ends a turn.
        pad: the padding token.
        n_merged: tokens that are trained, the 256 bytes among them.
    """
    tokenizer = Tokenizer(models.BPE())
    tokenizer.normalizer = normalizers.NFC()
    tokenizer.pre_tokenizer = pre_tokenizers.Sequence(
        [
            pre_tokenizers.Split(Regex(_SPLIT), behavior="isolated"),
            pre_tokenizers.ByteLevel(add_prefix_space=False, use_regex=False),
        ]
    )
    tokenizer.decoder = decoders.ByteLevel()
    trainer = trainers.BpeTrainer(
        vocab_size=n_merged,
        initial_alphabet=sorted(pre_tokenizers.ByteLevel.alphabet()),
        show_progress=False,
    )
    tokenizer.train_from_iterator(CORPUS.splitlines(), trainer)
    tokenizer.add_special_tokens(list(special))
    return PreTrainedTokenizerFast(
        tokenizer_object=tokenizer,
        eos_token=end,
        pad_token=pad,
        extra_special_tokens=[token for token in special if token not in (end, pad)],
        clean_up_tokenization_spaces=False,
    )
