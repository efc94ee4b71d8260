"""Byte-level BPE tokenizers trained on the spot, so that tiny models need no download."""

from collections.abc import Iterable, Mapping, Sequence

from tokenizers import (
    Regex,
    Tokenizer,
    decoders,
    models,
    normalizers,
    pre_tokenizers,
    processors,
    trainers,
)
from transformers import PreTrainedTokenizerFast

from model_adapters.tiny.corpus import CORPUS

__all__ = ["train_tokenizer"]

# Splits letters, single digits, punctuation and white space, as current byte-level tokenizers do.
_SPLIT = r"""[^\r\n\p{L}\p{N}]?\p{L}+|\p{N}| ?[^\s\p{L}\p{N}]+[\r\n]*|\s*[\r\n]+|\s+(?!\S)|\s+"""


def train_tokenizer(
    special: Sequence[str],
    *,
    end: str,
    pad: str,
    begin: str | None = None,
    named: Mapping[str, str],
    corpus: Iterable[str] = tuple(CORPUS.splitlines()),
    n_merged: int = 600,
) -> PreTrainedTokenizerFast:
    """Train a tokenizer.

    Args:
        special: special tokens, including those below; their ids follow those of the trained tokens
            in this order.
        end: token that ends a turn.
        pad: padding token.
        begin: token that begins every text, or None.
        named: attribute names of tokens that processors look up, such as `image_token`.
        corpus: texts to train on; by default the package's.
        n_merged: number of trained tokens, including the 256 bytes.
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
    tokenizer.train_from_iterator(corpus, trainer)
    tokenizer.add_special_tokens(list(special))
    if begin is not None:
        tokenizer.post_processor = processors.TemplateProcessing(
            single=f"{begin} $A", special_tokens=[(begin, tokenizer.token_to_id(begin))]
        )
    return PreTrainedTokenizerFast(
        tokenizer_object=tokenizer,
        bos_token=begin,
        eos_token=end,
        pad_token=pad,
        extra_special_tokens=dict(named),
        clean_up_tokenization_spaces=False,
    )
