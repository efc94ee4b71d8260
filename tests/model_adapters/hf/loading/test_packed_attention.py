"""Towers attend in all windows of one length at once, with the features of one after the other."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch.nn.functional import scaled_dot_product_attention
from transformers import AutoConfig, AutoModelForImageTextToText

from infthor_eval.storage.folders import packaged_folder
from model_adapters.hf.families.qwen2_5_vl import NANO_FOLDER
from model_adapters.hf.loading.packed_attention import pack_attention


def _tower(attention="sdpa"):
    config = AutoConfig.from_pretrained(packaged_folder(NANO_FOLDER))
    config.vision_config.fullatt_block_indexes = [1]
    torch.manual_seed(0)
    model = AutoModelForImageTextToText.from_config(config, attn_implementation=attention)
    return model.float().eval().model.visual


@torch.inference_mode()
def _features(tower, grids):
    n_patches = sum(time * height * width for time, height, width in grids)
    size = tower.patch_embed.proj.weight[0].numel()
    pixels = torch.randn(n_patches, size, generator=torch.Generator().manual_seed(1))
    return tower(pixels, torch.tensor(grids)).pooler_output


@given(
    grids=st.lists(
        st.tuples(st.integers(1, 2), st.integers(1, 5).map(lambda n: 4 * n), st.just(20)),
        min_size=1,
        max_size=4,
    )
)
@settings(max_examples=8, deadline=None)
def test_features_of_any_sizes_are_those_of_one_window_after_the_other(grids):
    plain, packed = _tower(), _tower()
    pack_attention(packed)
    torch.testing.assert_close(_features(packed, grids), _features(plain, grids))


def test_frames_of_one_size_take_no_more_calls_than_one(monkeypatch):
    calls = []

    def counted(*args, **options):
        calls.append(args[0].shape)
        return scaled_dot_product_attention(*args, **options)

    monkeypatch.setattr(torch.nn.functional, "scaled_dot_product_attention", counted)
    tower = _tower()
    pack_attention(tower)
    _features(tower, [(1, 12, 12)])
    of_one = len(calls)
    calls.clear()
    _features(tower, [(1, 12, 12)] * 5)
    assert len(calls) == of_one > 0


@pytest.mark.parametrize("attention", ["eager", "sdpa"])
def test_only_modules_that_attend_by_the_kernel_are_changed(attention):
    tower = _tower(attention)
    before = {name: module.config for name, module in tower.named_modules() if _has_config(module)}
    pack_attention(tower)
    changed = {
        name for name, module in tower.named_modules()
        if _has_config(module) and module.config is not before[name]
    }  # fmt: skip
    expected = {f"blocks.{layer}.attn" for layer in range(len(tower.blocks))}
    assert changed == (expected if attention == "sdpa" else set())
    assert tower.config._attn_implementation == attention


def _has_config(module):
    return hasattr(module, "config")
