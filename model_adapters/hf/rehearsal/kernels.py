"""Which kernel of torch's attention a call gets on a GPU, and what memory it takes for itself.

torch can be asked that only where it has a GPU, so its rules stand here, for GPUs from 2020 on
(compute capability 8 and above): `can_use_flash_attention`, `can_use_mem_efficient_attention` and
`preprocess_mask` of torch 2.13 (aten/src/ATen/native/transformers). On an H100 or H200 with cuDNN
above 9.15.1, cuDNN's kernel comes before both; it takes a mask, and heads of up to 128.
"""

from dataclasses import dataclass

import torch

FLASH = "flash"
EFFICIENT = "memory-efficient"
MATH = "math"

_HALVES = (torch.bfloat16, torch.float16)
_LARGEST_FLASH_HEAD = 256
_ALIGNED = 8  # elements that rows of a mask are padded to


@dataclass(frozen=True)
class Attention:
    """One call of attention.

    Attributes:
        kernel: kernel that torch chooses.
        has_mask: whether the call has a mask, which the flash kernel does not take.
        n_queries: tokens that attend.
        n_keys: tokens that are attended to.
        head_size: numbers of a head.
        flop: multiplications and additions.
        own_bytes: most memory within the call, without its output.
    """

    kernel: str
    has_mask: bool
    n_queries: int
    n_keys: int
    head_size: int
    flop: int
    own_bytes: int


def attention_of(
    query: torch.Tensor,
    key: torch.Tensor,
    value: torch.Tensor,
    mask: torch.Tensor | None,
    is_causal: bool,
    shares_keys: bool,
) -> Attention:
    """Return what becomes of a call of torch's attention.

    Args:
        query: queries, (..., heads, queries, head size).
        key: keys, (..., heads or key heads, keys, head size).
        value: values, like `key`.
        mask: truth values or numbers that are added to the scores, (..., queries, keys); or None.
        is_causal: whether a token attends to earlier ones alone, without a mask.
        shares_keys: whether several heads share the keys of one.
    """
    n_queries, head = query.shape[-2:]
    n_keys = key.shape[-2]
    n_scores = query.shape[:-1].numel() * n_keys
    kernel = _kernel(query, key, value, mask is not None, is_causal)
    half = 2 if is_causal and kernel != MATH else 1
    return Attention(
        kernel=kernel,
        has_mask=mask is not None,
        n_queries=n_queries,
        n_keys=n_keys,
        head_size=head,
        flop=2 * n_scores * (head + value.shape[-1]) // half,
        own_bytes=_own_bytes(kernel, query, key, value, mask, is_causal, shares_keys),
    )


def _kernel(
    query: torch.Tensor, key: torch.Tensor, value: torch.Tensor, has_mask: bool, is_causal: bool
) -> str:
    sizes = {tensor.shape[-1] for tensor in (query, key, value)}
    is_square = query.shape[-2] == key.shape[-2]
    if (
        query.dtype in _HALVES
        and not has_mask
        and len(sizes) == 1
        and max(sizes) <= _LARGEST_FLASH_HEAD
        and (is_square or not is_causal)
    ):
        return FLASH
    aligned = 16 // query.element_size()  # of tensor cores
    fits = query.shape[-1] == key.shape[-1] and not any(size % aligned for size in sizes)
    return EFFICIENT if fits and query.dtype in (*_HALVES, torch.float32) else MATH


def _own_bytes(
    kernel: str,
    query: torch.Tensor,
    key: torch.Tensor,
    value: torch.Tensor,
    mask: torch.Tensor | None,
    is_causal: bool,
    shares_keys: bool,
) -> int:
    n_rows = query.shape[:-1].numel()
    mask_bytes = 0  # of a mask of numbers that is made of one of truth values
    if mask is not None and mask.dtype == torch.bool:
        mask_bytes = mask.numel() * query.element_size()
    if kernel == FLASH:
        return n_rows * 4  # the sums of the rows
    if kernel == EFFICIENT:
        if mask is None or key.shape[-2] % _ALIGNED == 0:
            return mask_bytes
        return mask_bytes + mask.numel() * query.element_size()  # a copy with longer rows
    # In float32: queries, and keys and values for each head its own; scores, and their softmax.
    n_shared = query.shape[-3] // key.shape[-3] if shares_keys else 1
    inputs = query.numel() + (key.numel() + value.numel()) * n_shared
    causal = query.shape[-2] * key.shape[-2] if is_causal else 0
    return mask_bytes + 4 * (inputs + causal + 2 * n_rows * key.shape[-2])
