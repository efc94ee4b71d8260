"""Windows against attention that is computed pair by pair, and against the published positions."""

from functools import partial

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from model_adapters.hf.sparse.layout import Layout
from model_adapters.hf.sparse.rotation import Rotation
from model_adapters.hf.sparse.window import WindowAttention
from model_adapters.options.attention import Window

from .reference import FREQUENCIES, attend_densely, rotate

TURN = Rotation(FREQUENCIES)
HEADS, SHARED = 2, 2  # key heads, and heads that share one


def _causal(rows, columns):
    return columns <= rows[:, None]


def _distance(i, j, *, sinks, window, positions, of):
    """How far behind token i is token j; `of` has the frame of each token, or itself."""
    whole = [at for at, frame in enumerate(of) if frame == of[j]]
    if j > i:
        return None
    if i - whole[0] < window or of[j] == of[i]:
        return i - j
    if whole[-1] >= sinks:
        return None
    if positions == "absolute":
        return i - j
    if positions == "ceiling":
        return window
    ends = {frame: at for at, frame in enumerate(of)}
    first_ones = [at for at, frame in enumerate(of) if ends[frame] < sinks]
    begin = next(at for at in range(i + 1) if i - of.index(of[at]) < window or of[at] == of[i])
    return i - begin + min(begin, len(first_ones)) - j


@st.composite
def readings(draw):
    """Sizes of frames and texts in the order of a sequence, and of the chunks it is read in."""
    widths = draw(st.lists(st.sampled_from([1, 1, 1, 2, 5]), min_size=1, max_size=14))
    ends = sorted(draw(st.sets(st.integers(1, len(widths)), max_size=5)) | {len(widths)})
    return widths, ends


@settings(max_examples=500, deadline=None)
@given(
    reading=readings(),
    sinks=st.integers(0, 6),
    window=st.integers(1, 20),
    positions=st.sampled_from(["absolute", "ceiling", "cache"]),
    by_frames=st.booleans(),
    drops=st.booleans(),
)
def test_it_is_dense_attention_under_the_same_mask(
    reading, sinks, window, positions, by_frames, drops
):
    widths, ends = reading
    positions = positions if sinks else "absolute"
    n = sum(widths)
    states = torch.randn(3, HEADS * SHARED, n, 8, generator=torch.Generator().manual_seed(n))
    query, key, value = states[0], states[1, ::SHARED], states[2, ::SHARED]
    of = list(range(n))
    if by_frames:
        of = [at for at, width in enumerate(widths) for _ in range(width)]
    rule = partial(_distance, sinks=sinks, window=window, positions=positions, of=of)
    repeated = [it.repeat_interleave(SHARED, 0) for it in (key, value)]
    expected = attend_densely(query, *repeated, rule)

    attention = WindowAttention(Window(sinks, window), positions, [TURN])
    numbers = torch.arange(n)
    layout = Layout.empty(torch.device("cpu"))
    stored = torch.empty(2, HEADS, 0, 8)
    rows = []
    begin = 0
    for end in ends:
        start, stop = sum(widths[:begin]), sum(widths[:end])
        if drops:  # what later tokens do not see
            kept = attention.n_sinks(layout)
            behind = kept + attention.n_unseen(layout, start)
            layout = layout[:kept] + layout[behind:]
            stored = torch.cat((stored[:, :, :kept], stored[:, :, behind:]), dim=2)
            assert len(layout) <= sinks + window + max(widths)
        pieces = [0 if width == 1 else _Frame(width) for width in widths[begin:end]]
        layout += Layout.of(pieces, start, numbers[None, start:stop], by_frames=by_frames)
        turned = rotate(key[:, start:stop], numbers[start:stop])
        stored = torch.cat((stored, torch.stack((turned, value[:, start:stop]))), dim=2)
        output = attention.plan(layout, stop - start, _causal)(
            0,
            rotate(query[:, start:stop], numbers[start:stop]).unflatten(0, (HEADS, SHARED)),
            stored[0][:, None],
            stored[1][:, None],
            None,
        )
        rows.append(output.flatten(0, 1))
        begin = end
    torch.testing.assert_close(torch.cat(rows, dim=1), expected, atol=1e-5, rtol=1e-5)


class _Frame:
    def __init__(self, width):
        self.ids = (0,) * width


# Run on the published code, with 2 first tokens and 4 last ones (LM-Infinite: distances 0 to 3),
# or 4 kept ones and the query (StreamingLLM).
LM_INFINITE = {
    10: {0: 4, 1: 4, 7: 3, 8: 2, 9: 1, 10: 0},
    6: {0: 4, 1: 4, 3: 3, 4: 2, 5: 1, 6: 0},
    5: {0: 4, 1: 4, 2: 3, 3: 2, 4: 1, 5: 0},
    4: {0: 4, 1: 3, 2: 2, 3: 1, 4: 0},
    3: {0: 3, 1: 2, 2: 1, 3: 0},
}
# Positions within the cache: the query's less each key's.
STREAMING_LLM = {
    9: {0: 6, 1: 5, 5: 4, 6: 3, 7: 2, 8: 1, 9: 0},
    6: {0: 6, 1: 5, 2: 4, 3: 3, 4: 2, 5: 1, 6: 0},
    10: {0: 6, 1: 5, 6: 4, 7: 3, 8: 2, 9: 1, 10: 0},
}


def _listed(distances, i, j):
    return distances.get(i, {i: 0.0}).get(j)


@pytest.mark.parametrize(
    ("positions", "window", "published"), [("ceiling", 4, LM_INFINITE), ("cache", 5, STREAMING_LLM)]
)
def test_distances_are_those_of_the_published_code(positions, window, published):
    n = max(published) + 1
    states = torch.randn(3, 1, n, 8, generator=torch.Generator().manual_seed(0))
    numbers = torch.arange(n)
    layout = Layout.of([0] * n, 0, numbers[None], by_frames=False)
    output = WindowAttention(Window(2, window), positions, [TURN]).plan(layout, n, _causal)(
        0,
        rotate(states[0], numbers)[None],
        rotate(states[1], numbers)[None],
        states[2][None],
        None,
    )
    for row, distances in published.items():
        # Other queries see themselves.
        listed = partial(_listed, {row: distances})
        expected = attend_densely(*states[:, :, : row + 1], listed)
        torch.testing.assert_close(output[0, 0, row], expected[0, row], atol=1e-5, rtol=1e-5)


def test_a_window_that_goes_on_needs_what_was_not_dropped():
    attention = WindowAttention(Window(2, 5))
    whole = Layout.of([0] * 20, 0, torch.arange(20)[None], by_frames=False)
    assert attention.first_seen(whole) == 0
    kept = whole[:2] + whole[12:]
    assert attention.first_seen(kept) == 16
    assert attention.n_unseen(kept, 16) == 0
    assert attention.n_unseen(kept, 17) == 1
