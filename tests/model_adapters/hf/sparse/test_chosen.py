"""Chosen keys against what plain loops over pairs choose."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from model_adapters.hf.sparse import chosen
from model_adapters.hf.sparse.chosen import ChosenAttention
from model_adapters.hf.sparse.layout import Layout
from model_adapters.options.attention import BlockSparse, VerticalSlash

BLOCK, LAST, FIRST, NEAR = 4, 3, 1, 1  # so that short sequences have many
SHARED = 2  # heads that share a key head


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(chosen, "_BLOCK", BLOCK)
    monkeypatch.setattr(chosen, "_LAST", LAST)
    monkeypatch.setattr(chosen, "_FIRST_COLUMNS", FIRST)
    monkeypatch.setattr(chosen, "_NEAR_BANDS", NEAR)


class _Frame:
    def __init__(self, width):
        self.ids = (0,) * width


def _causal(rows, columns):
    return columns[..., None, :] <= rows[:, None]


def _lines(query, key, share, of):
    """Which keys each query of a head sees: (queries, keys)."""
    n, n_keys = len(query), len(key)
    before = n_keys - n
    weights = torch.zeros(LAST, n_keys)
    for row in range(LAST):
        until = n_keys - LAST + row + 1
        scores = key[:until] @ query[n - LAST + row] / query.shape[1] ** 0.5
        weights[row, :until] = scores.softmax(0)
    count = round(share * n_keys)
    column = [
        float(weights[:, [at for at in range(n_keys) if of[at] == frame]].sum()) for frame in of
    ]
    diagonal = [0.0] * n_keys
    for row in range(LAST):
        for at in range(n_keys - LAST + row + 1):
            diagonal[n_keys - LAST + row - at] += float(weights[row, at])
    columns = _largest(column, count, FIRST)
    bands = [sum(diagonal[at : at + BLOCK]) for at in range(0, n_keys, BLOCK)]
    chosen = _largest(bands, max(1, round(share * n_keys / BLOCK)), NEAR)
    return torch.tensor(
        [
            [
                at <= before + row and (at in columns or (before + row - at) // BLOCK in chosen)
                for at in range(n_keys)
            ]
            for row in range(n)
        ]
    )


def _largest(scores, count, n_forced):
    order = sorted(range(len(scores)), key=lambda at: (at >= n_forced, -scores[at], at))
    return set(order[: max(count, min(n_forced, len(scores)))])


def _blocks(query, key, count, of):
    n, n_keys = len(query), len(key)
    before = n_keys - n
    names, run = [], 0
    for at in range(n_keys):  # frames, and texts of at most so many tokens between them
        is_frame = of.count(of[at]) > 1
        same = at and (of[at] == of[at - 1] if is_frame else of.count(of[at - 1]) == 1)
        run = run + 1 if same else 0
        is_new = not same or (not is_frame and run % BLOCK == 0)
        names.append(names[-1] + is_new if at else 0)
    means = [
        key[[at for at in range(n_keys) if names[at] == name]].mean(0)
        for name in range(names[-1] + 1)
    ]
    seen = torch.zeros(n, n_keys, dtype=torch.bool)
    for at in range(0, n, BLOCK):
        end = min(at + BLOCK, n)
        own = set(names[before + at : before + end])
        pooled = query[at:end].mean(0)
        earlier = sorted(
            range(max(own) + 1),
            key=lambda name: (name not in own, -float(pooled @ means[name]), name),
        )
        taken = own | set(earlier[:count])
        for row in range(at, end):
            for column in range(before + row + 1):
                seen[row, column] = names[column] in taken
    return seen


@settings(max_examples=250, deadline=None)
@given(
    shape=st.one_of(st.floats(0.02, 0.6).map(VerticalSlash), st.integers(1, 6).map(BlockSparse)),
    widths=st.lists(st.sampled_from([1, 1, 1, 2, 5]), min_size=2, max_size=16),
    n_before=st.integers(0, 12),
    by_frames=st.booleans(),
)
def test_it_is_dense_attention_under_the_mask_that_loops_choose(shape, widths, n_before, by_frames):
    n_keys = sum(widths)
    n = max(1, n_keys - n_before)
    draw = torch.Generator().manual_seed(n_keys + 100 * n_before)
    query = torch.randn(2, SHARED, n, 8, generator=draw)
    key, value = torch.randn(2, 2, 1, n_keys, 8, generator=draw)
    of = [at for at, width in enumerate(widths) for _ in range(width)]
    of = of if by_frames else list(range(n_keys))
    pieces = [0 if width == 1 else _Frame(width) for width in widths]
    layout = Layout.of(pieces, 0, torch.arange(n_keys)[None], by_frames=by_frames)
    output = ChosenAttention(shape).plan(layout, n, _causal)(0, query, key, value, None)
    for group in range(2):
        for within in range(SHARED):
            states = query[group, within], key[group, 0]
            if n <= LAST:
                seen = _causal(torch.arange(n_keys - n, n_keys), torch.arange(n_keys))
            elif isinstance(shape, VerticalSlash):
                seen = _lines(*states, shape.share, of)
            else:
                seen = _blocks(*states, shape.n_blocks, of)
            scores = (states[0] @ states[1].T / 8**0.5).masked_fill(~seen, -torch.inf)
            expected = scores.softmax(-1) @ value[group, 0]
            torch.testing.assert_close(output[group, within], expected, atol=1e-5, rtol=1e-5)
