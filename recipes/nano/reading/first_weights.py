"""The decoder's first weights: names and features in one code, and heads that compare them.

From random weights a decoder of this size learns what a kitchen is like and no more; to attend to
the frame with the thing in question takes longer than anybody trains it. So it begins there. The
width is five parts: for loose things, for fixtures, for what is held or open, for the receptacle
that something is in, and for all else. Each type has a code in a part, the same in the features of
its units and in the words that name it. Heads compare one part of a token with one part of another
and hand a third one on, or look at tokens so many positions before. All weights are trained from
there on.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import torch
from torch import Tensor

from model_adapters.hf.loading.loaded import LoadedCheckpoint
from recipes.nano.seeing.units import Role, Units
from recipes.nano.spelling import spellings


class Part(IntEnum):
    """Parts of the width."""

    THING = 0
    FIXTURE = 1
    STATE = 2
    PLACE = 3
    REST = 4


@dataclass(frozen=True)
class _Head:
    """What a head does at first.

    Attributes:
        value: part that it hands on.
        to: part that it adds this to.
        query: part of the token that looks, which is compared; None if a look is by position alone.
        key: part of the token that is looked at.
        back: number of positions that it looks back; 0 for anywhere.
        at_names: True if it looks at all names alike.
        tells_open: True if it hands on nothing but whether it looks at something open.
        strength: of what it compares.
    """

    value: Part
    to: Part
    query: Part | None = None
    key: Part | None = None
    back: int = 0
    at_names: bool = False
    tells_open: bool = False
    strength: float = 1.0


def _heads(grid: int) -> tuple[tuple[_Head, ...], ...]:
    """Return the heads of each layer, for frames of as many tokens along each side; further layers
    are like the last.

    A frame takes `grid` positions and one before and after; its end comes `grid` after its tokens.
    """
    own, before = grid, 2 * grid + 2
    thing, fixture, state, place, rest = Part
    where = _Head(place, fixture, thing, thing)  # the thing's place
    contents = _Head(thing, thing, fixture, place)  # what is in the fixture
    held_before = _Head(state, thing, back=before)
    answers = (
        contents,
        where,
        _Head(thing, thing, back=2),
        _Head(fixture, fixture, back=2),
        _Head(rest, rest, back=1),
    )
    is_there = _Head(rest, rest, thing, thing)
    named = (
        is_there,
        where,
        _Head(thing, thing, back=2),
        _Head(rest, rest, at_names=True),
        _Head(rest, rest, back=1),
    )
    return (
        (
            where,
            contents,
            _Head(state, state, back=own),
            held_before,
            # First of all, as `where` makes a name like that of the place, too.
            _Head(rest, rest, fixture, state, tells_open=True, strength=_OPEN_LOOK),
        ),
        (
            _Head(place, place, thing, thing, back=own),
            _Head(rest, rest, thing, state),
            is_there,
            held_before,
            contents,
        ),
        answers,
        named,
    )


# Scales of the first weights, chosen by how well an untrained decoder finds what happened and where
# things are (README.md).
_WORD_NOISE = 0.01
_NAME_REST = 0.4  # of the part for all else, in the code of a name
_NAME_NOISE = 0.02
_FEATURE = 0.4
_CONTENT = 0.25  # of every part of a frame; one that shows nothing would be noise, made large
_FIXTURE_FEATURE = 0.7
_HELD_REST, _OPEN_REST = 0.3, 1.0
_NAMED = 1.0  # of the mark of names
_AT_NAMES = 80.0
_ALOUD = 3.0  # what is open is handed on so much stronger from a name to the answer
_YES = 0.7  # of the mark of what is open, in "yes", and its opposite in "no"
_OPEN_STATE = 1.75  # names of loose things are in two parts, so each is weaker
_MATCH = 0.8
_OPEN_LOOK = 1.5  # strength of the comparison of names with what is open
_SINK = 3.0
_HAND_ON = 0.7
_LOOK = 3.4
_LOOK_AND_MATCH = 0.6  # of a look's scale, for heads that also compare
_LOOK_AWAY = 3.2
_N_FAST = 8  # frequencies by which positions are told apart
_SLOW = 0.012  # radians a position; slower ones do not change in a few frames
_QUERY_NOISE, _VALUE_NOISE = 0.05, 0.03
_MLP = 0.15  # of an MLP's usual scale: by it, its noise would hide what heads hand on


def part_width(hidden: int) -> int:
    """Return the width of a part, which is that of a head, too."""
    return hidden // len(Part)


@dataclass(frozen=True)
class _Codes:
    """Codes of the types, [types, part width], of the sinks and of marks, [part width].

    A sink is looked at by a head that finds nothing; the token before each frame has it. Marks are
    in the part for all else: of names, of what a frame shows open, and of a name whose thing is
    open. Nothing else has the first and the last, so that they can be told from all else.
    """

    things: Tensor
    fixtures: Tensor
    thing_sink: Tensor
    fixture_sink: Tensor
    named: Tensor
    shown_open: Tensor
    is_open: Tensor

    def without_marks(self, rest: Tensor) -> Tensor:
        """Return vectors of the part for all else, [n, part width], without those two marks."""
        marks = torch.stack([self.named, self.is_open])
        return rest - (rest @ marks.T) @ marks


def _sink(part: Part, codes: _Codes) -> Tensor:
    return codes.thing_sink if part in (Part.THING, Part.STATE) else codes.fixture_sink


class _Setter:
    """Sets the weights of one model."""

    def __init__(self, loaded: LoadedCheckpoint, units: Units, seed: int) -> None:
        self._model = loaded.model
        self._tokenizer = loaded.tokenizer
        self._units = units
        self._random = torch.Generator().manual_seed(seed)
        config = loaded.model.config.text_config
        self._hidden: int = config.hidden_size
        self._width = part_width(self._hidden)
        self._theta: float = config.rope_parameters["rope_theta"]

    def _normal(self, *shape: int) -> Tensor:
        return torch.randn(*shape, generator=self._random)

    def _directions(self, n: int) -> Tensor:
        """Return random vectors of length one, [n, part width]."""
        vectors = self._normal(n, self._width)
        return vectors / vectors.norm(dim=-1, keepdim=True)

    def _part(self, part: Part) -> slice:
        return slice(part * self._width, (part + 1) * self._width)

    def codes(self, loose: Sequence[bool], fixtures: Sequence[bool]) -> _Codes:
        """Return random codes; those of loose types are orthogonal, and those of fixtures, as far
        as a part is wide enough."""
        chosen = []
        sinks = []
        for is_coded in (loose, fixtures):
            vectors = self._directions(len(self._units.types))
            basis = torch.empty(self._width, self._width)
            torch.nn.init.orthogonal_(basis, generator=self._random)
            places = [at for at, coded in enumerate(is_coded) if coded][: self._width - 1]
            vectors[places] = basis[: len(places)]
            chosen.append(vectors)
            sinks.append(basis[-1])
        marks = torch.empty(self._width, self._width)
        torch.nn.init.orthogonal_(marks, generator=self._random)
        return _Codes(*chosen, *sinks, *marks[:3])

    def set_words(self, codes: _Codes, loose: Tensor) -> None:
        """Set the embeddings: of names by the codes, of all else at random."""
        words = self._model.get_input_embeddings().weight
        words.copy_(_WORD_NOISE * self._normal(*words.shape))
        rest = self._part(Part.REST)
        words[:, rest] = codes.without_marks(self._directions(len(words)))
        for at, name in enumerate(self._units.types):
            for token in self._single_tokens(*spellings(name)):
                code = _NAME_NOISE * self._normal(self._hidden)
                code[self._part(Part.THING)] += codes.things[at] * loose[at]
                # What is no fixture can be open, too.
                code[self._part(Part.FIXTURE)] += codes.fixtures[at]
                code[rest] += _NAME_REST * self._directions(1)[0]
                code[rest] = codes.without_marks(code[None, rest])[0] + _NAMED * codes.named
                words[token] = code
        for word, sign in (("yes", 1), ("no", -1)):
            for token in self._single_tokens(word):
                words[token, rest] += sign * _YES * codes.is_open
        sink = _WORD_NOISE * self._normal(self._hidden)
        for part in (Part.THING, Part.STATE):
            sink[self._part(part)] = codes.thing_sink
        for part in (Part.FIXTURE, Part.PLACE):
            sink[self._part(part)] = codes.fixture_sink
        words[self._model.config.vision_start_token_id] = sink

    def _single_tokens(self, *texts: str) -> list[int]:
        """Return the tokens of those texts that have one."""
        spelled = [self._tokenizer(text, add_special_tokens=False)["input_ids"] for text in texts]
        return [ids[0] for ids in spelled if len(ids) == 1]

    def set_features(self, codes: _Codes, loose: Tensor, fixtures: Tensor) -> None:
        """Set the merger's second layer, which turns units into features."""
        n_types = len(self._units.types)
        features = torch.zeros(self._hidden, len(Role), n_types)
        held, content = codes.without_marks(self._directions(2))
        features[self._part(Part.THING), Role.SHOWN] = (codes.things * loose[:, None]).T
        features[self._part(Part.FIXTURE), Role.SHOWN] = (
            _FIXTURE_FEATURE * codes.fixtures * fixtures[:, None]
        ).T
        features[self._part(Part.STATE), Role.HELD] = codes.things.T
        features[self._part(Part.REST), Role.HELD] = _HELD_REST * held[:, None]
        features[self._part(Part.STATE), Role.OPEN] = _OPEN_STATE * codes.fixtures.T
        features[self._part(Part.REST), Role.OPEN] = _OPEN_REST * codes.shown_open[:, None]
        features[self._part(Part.PLACE), Role.AROUND] = codes.fixtures.T
        layer = self._model.model.visual.merger.mlp[2]
        layer.weight.zero_()
        layer.weight[:, : len(self._units)] = _FEATURE * features.flatten(1)
        layer.bias.zero_()
        layer.bias[self._part(Part.REST)] = _CONTENT * content

    def set_layer(self, layer: Any, heads: Sequence[_Head], codes: _Codes, n_layers: int) -> None:
        """Set a layer's attention to what its heads do, and its MLP at random."""
        attention, mlp = layer.self_attn, layer.mlp
        rest = self._part(Part.REST)
        scale = self._hidden**-0.5
        deep = (2 * n_layers) ** -0.5
        noise = {
            attention.q_proj: _QUERY_NOISE,
            attention.k_proj: _QUERY_NOISE,
            attention.v_proj: _VALUE_NOISE,
            attention.o_proj: _VALUE_NOISE * deep,
            mlp.gate_proj: 1.0,
            mlp.up_proj: 1.0,
            mlp.down_proj: _MLP * _VALUE_NOISE * deep / math.sqrt(3),
        }
        for linear, strength in noise.items():
            linear.weight.copy_(strength * scale * self._normal(*linear.weight.shape))
            if linear.bias is not None:
                linear.bias.zero_()
        for linear in (attention.o_proj, mlp.down_proj):
            linear.weight[rest] = codes.without_marks(linear.weight[rest].T).T
        for number, head in enumerate(heads):
            rows = slice(number * self._width, (number + 1) * self._width)
            self._set_query(attention, rows, head, codes)
            self._set_value(attention, rows, head, codes)

    def _set_query(self, attention: Any, rows: slice, head: _Head, codes: _Codes) -> None:
        """Set what a head looks at."""
        self._compare(attention, rows, head, codes)
        if head.back:
            share = 1.0 if head.query is None else _LOOK_AND_MATCH
            self._look(attention, rows, head.back, _LOOK * share)
        elif head.at_names:
            slowest = rows.stop - 1
            attention.q_proj.bias[slowest] += _AT_NAMES
            attention.k_proj.weight[slowest, self._part(Part.REST)] += codes.named
        elif head.query is head.key:  # the token itself is most like itself
            self._look(attention, rows, 0, -_LOOK_AWAY)

    def _set_value(self, attention: Any, rows: slice, head: _Head, codes: _Codes) -> None:
        """Set what a head hands on."""
        rest = self._part(Part.REST)
        if head.tells_open:
            attention.v_proj.weight[rows.start, rest] += codes.shown_open
            attention.o_proj.weight[rest, rows.start] += codes.is_open
            return
        identity = _HAND_ON * torch.eye(self._width)
        attention.o_proj.weight[self._part(head.to), rows] += identity
        attention.v_proj.weight[rows, self._part(head.value)] += identity
        self._keep_sink(attention.v_proj.weight[rows, self._part(head.value)], head, codes)
        values = attention.v_proj.weight[rows, rest]
        told = torch.outer(values @ codes.is_open, codes.is_open)
        values.copy_(codes.without_marks(values))
        if head.at_names:
            values += _ALOUD * told

    def _keep_sink(self, handed_on: Tensor, head: _Head, codes: _Codes) -> None:
        """Have a head not hand on the sink: tokens that got it would be looked at for one."""
        if head.value is Part.REST:
            return
        sink = _sink(head.value, codes)
        handed_on -= torch.outer(handed_on @ sink, sink)

    def _frequencies(self) -> Tensor:
        """Return the head's frequencies, radians a position, the fastest first."""
        half = self._width // 2
        return self._theta ** (-torch.arange(half) / half)

    def _compare(self, attention: Any, rows: slice, head: _Head, codes: _Codes) -> None:
        """Compare parts by the slow frequencies, which a few frames do not turn."""
        if head.query is None or head.key is None:
            return
        slow = (self._frequencies() < _SLOW).float().repeat(2)
        match = head.strength * _MATCH * torch.eye(self._width) * slow[:, None]
        attention.q_proj.weight[rows, self._part(head.query)] += match
        attention.k_proj.weight[rows, self._part(head.key)] += match
        attention.q_proj.bias[rows] += head.strength * _SINK * _sink(head.key, codes) * slow

    def _look(self, attention: Any, rows: slice, back: int, strength: float) -> None:
        """Look so many positions back by the fast frequencies, which turn keys against queries.

        With a negative strength look past the token there.
        """
        half = self._width // 2
        n = min(_N_FAST, half)
        angle = self._frequencies()[:n] * back
        query, key = (one.bias[rows] for one in (attention.q_proj, attention.k_proj))
        query[:n] += strength
        key[:n] += abs(strength) * torch.cos(angle)
        key[half : half + n] += abs(strength) * torch.sin(angle)


def set_first_weights(
    loaded: LoadedCheckpoint,
    units: Units,
    loose: Sequence[bool],
    fixtures: Sequence[bool],
    grid: int,
    seed: int,
) -> None:
    """Set the weights of the decoder, of the embeddings and of the merger's second layer.

    Args:
        loaded: the model, with as many heads as there are parts.
        units: units of the merger's first layer.
        loose: [types], True for types of things that can be picked up.
        fixtures: [types], True for types of receptacles and of what can be opened.
        grid: tokens along each side of a frame.
        seed: seed of all that is random.
    """
    setter = _Setter(loaded, units, seed)
    are_loose, are_fixtures = torch.tensor([*loose]).float(), torch.tensor([*fixtures]).float()
    plans = _heads(grid)
    with torch.no_grad():
        codes = setter.codes(loose, fixtures)
        setter.set_words(codes, are_loose)
        setter.set_features(codes, are_loose, are_fixtures)
        layers = loaded.model.get_decoder().layers
        for number, layer in enumerate(layers):
            setter.set_layer(layer, plans[min(number, len(plans) - 1)], codes, len(layers))
