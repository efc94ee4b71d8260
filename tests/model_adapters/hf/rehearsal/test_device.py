"""The device without numbers: integers keep their values, memory is added up and given back."""

import gc

import torch

from model_adapters.hf.rehearsal.device import DEVICE, ShapesDevice


def test_integers_keep_their_values_and_numbers_do_not():
    device = ShapesDevice()
    with device.running():
        ids = torch.tensor([[3, 1, 2]], device=DEVICE)
        more = torch.cat([ids, torch.arange(2, device=DEVICE)[None]], dim=1)
        embedded = torch.nn.functional.embedding(more, torch.empty(8, 16, device=DEVICE))
        picked = embedded[more > 1]
    assert more.tolist() == [[3, 1, 2, 0, 1]]
    assert embedded.is_meta and embedded.shape == (1, 5, 16)
    assert picked.shape == (2, 16)
    assert device.holds(more) and device.holds(embedded)


def test_what_is_elsewhere_is_computed_and_not_counted():
    device = ShapesDevice()
    with device.running():
        product = torch.ones(64, 64) @ torch.ones(64, 64)
    assert product[0, 0] == 64
    assert (device.allocated, device.peak) == (0, 0)


def test_memory_is_what_is_allocated_at_a_time():
    device = ShapesDevice()
    with device.running():
        kept = torch.empty(1000, dtype=torch.bfloat16, device=DEVICE)
        doubled = kept + kept
        view = doubled[:10]
        del doubled
        assert device.allocated == 2 * 2000  # the view holds it
        del view
        gc.collect()
        assert device.allocated == 2000
        assert device.peak == 4000
        device.reset_peak()
        assert device.peak == 2000
        kept.add_(1)
        assert device.peak == 2000  # in place
        device.use(500)
        assert (device.allocated, device.peak) == (2000, 2500)


def test_a_long_mask_takes_memory_without_values():
    device = ShapesDevice()
    n_queries, n_keys = 1000, 1_000_000
    with device.running():
        keys = torch.arange(n_keys, device=DEVICE)
        mask = keys[None] <= torch.arange(n_queries, device=DEVICE)[:, None]
    assert mask.is_meta and mask.dtype == torch.bool
    assert device.allocated >= n_queries * n_keys


def test_experts_are_chosen_in_turn():
    device = ShapesDevice()
    with device.running():
        scores = torch.empty(6, 4, device=DEVICE)
        values, experts = torch.topk(scores, 2, dim=-1)
        counts = torch.histc(experts.flatten().int(), bins=4, min=0, max=3)
    assert values.is_meta and values.shape == (6, 2)
    assert experts.flatten().tolist() == [0, 1, 2, 3] * 3
    assert counts.tolist() == [3, 3, 3, 3]


def test_attention_is_noted_and_takes_no_square_of_the_context():
    device = ShapesDevice()
    with device.running():
        query = torch.empty(1, 8, 1024, 64, dtype=torch.bfloat16, device=DEVICE)
        key = torch.empty(1, 2, 1024, 64, dtype=torch.bfloat16, device=DEVICE)
        before = device.allocated
        device.reset_peak()
        out = torch.nn.functional.scaled_dot_product_attention(
            query, key, key, is_causal=True, enable_gqa=True
        )
    (call,) = device.attention
    assert out.shape == query.shape
    assert (call.kernel, call.has_mask, call.n_keys) == ("flash", False, 1024)
    assert call.flop == 4 * 8 * 1024 * 1024 * 64 // 2
    assert device.allocated - before == query.nbytes
    assert device.peak - before < 1024 * 1024 * 8
