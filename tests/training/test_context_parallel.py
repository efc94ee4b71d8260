"""How sequences are cut, and attention of a part to the whole."""

from collections.abc import Callable

import pytest
import torch
from torch.nn.functional import scaled_dot_product_attention

from infthor_eval.training.context_parallel import SequenceSplit, _flash_attention, causal_attention

Kernel = Callable[..., torch.Tensor]


def test_each_rank_has_a_chunk_from_the_head_and_one_from_the_tail():
    whole = torch.arange(10)[None]
    shares = [SequenceSplit(rank, 2).local_part(whole, -1).tolist() for rank in range(2)]
    assert shares == [[[0, 1, 2, 9, -1, -1]], [[3, 4, 5, 6, 7, 8]]]


@pytest.mark.parametrize("n_tokens", [1, 7, 8, 9, 64])
def test_shares_are_all_of_the_sequence(n_tokens):
    whole = torch.arange(3 * n_tokens).reshape(3, 1, n_tokens)
    shares = [SequenceSplit(rank, 4).local_part(whole, -1) for rank in range(4)]
    assert len({share.shape for share in shares}) == 1
    result = torch.cat(shares, dim=-1)
    assert sorted(result[result >= 0].tolist()) == whole.flatten().tolist()


# On the CPU the second kernel uses the mask, too, by the same call.
@pytest.mark.parametrize("kernel", [causal_attention, _flash_attention])
@pytest.mark.parametrize("n_own", [1, 300, 700])
@pytest.mark.parametrize("n_key_heads", [1, 2, 4])
def test_the_last_queries_see_what_they_see_in_the_whole(kernel, n_own, n_key_heads):
    torch.manual_seed(0)
    query, key, value = (
        torch.randn(2, heads, 700, 8, requires_grad=True) for heads in (4, n_key_heads, n_key_heads)
    )
    weights = torch.randn(2, 4, n_own, 8)
    whole = scaled_dot_product_attention(
        query, key, value, is_causal=True, scale=0.5, enable_gqa=True
    )[:, :, -n_own:]
    expected = torch.autograd.grad((whole * weights).sum(), (query, key, value))
    result = kernel(query[:, :, -n_own:], key, value, 0.0, 0.5)
    torch.testing.assert_close(result, whole)
    gradients = torch.autograd.grad((result * weights).sum(), (query, key, value))
    for one, other in zip(gradients, expected, strict=True):
        torch.testing.assert_close(one, other, atol=1e-5, rtol=1e-4)
