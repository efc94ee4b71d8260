"""How pairs of twins were answered (docs/reference/metrics.md).

Intervals are clustered by the trajectory that both worlds were made of, so pairs of one edit, and
of one fact, are within one cluster.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import msgspec

from infthor_eval.distances import AGES, DISTANCES, LENGTHS, age_class, distance_class, length_class
from infthor_eval.facets import Facet
from infthor_eval.grouping import grouped
from infthor_eval.nieh.records import NiehAnswer, TwinSide
from infthor_eval.nieh.results.retention import Ladder, Retention, retention_of
from infthor_eval.nieh.scoring import SCORERS, compared_form, scores
from infthor_eval.pairs import Pairs, PairScore, PairShares, net_pairs
from infthor_eval.rates import Rate
from infthor_eval.runs import UnitRecord

# Frames shown, in classes that double, as budgets of memories do.
_SIZES = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)
N_SHOWN = (*(f"<={size}" for size in _SIZES), f">{_SIZES[-1]}")
SHOWN_DIFFERENCE = ("yes", "no")
N_CLUES = ("1", "2", ">=3")

Record = UnitRecord[NiehAnswer]


class PairSummary(msgspec.Struct, frozen=True):
    """The summary of a task's pairs. Rates are 0 to 1, with intervals by trajectory.

    Attributes:
        n_pairs: number of pairs, in each variant of the context.
        n_facts: number of different facts that they are about.
        n_trajectories: number of trajectories that their worlds were made of.
        n_incomplete: number of questions that have no answer, or whose twin has none; they are in
            no pair.
        net_pairs: pairs right less pairs exchanged: the primary metric, -1 to 1, with the
            bootstrap interval of that difference.
        pair_accuracy: both answers right, with full marks.
        pairs_exchanged: both answers right in the other world, with full marks there.
        by_fact: mean over facts of their net pairs.
        single: single answers right, with full marks.
        flipped: the reply to the twin is another.
        right_when_flipped: of these pairs, both right; None if no reply differs.
        one_right: exactly one of both is right.
        one_is_commoner: of these pairs, the right one has the commoner gold answer of its form
            (a half where both are as common): prior knowledge, not memory; None if there are none.
        placebo: of the placebo pairs, whose frames differ and whose answers do not: both right;
            None without any. They are in no other rate.
        retention: what is left of net pairs as the evidence grows older; None unless questions
            were asked at several moments.
        by: net pairs by facet and class (`PAIR_FACETS`): `by_FACET` in results.json.
        scores: net score of each pair, by the trajectory that its worlds were made of.
    """

    n_pairs: int
    n_facts: int
    n_trajectories: int
    n_incomplete: int
    net_pairs: Rate
    pair_accuracy: Rate
    pairs_exchanged: Rate
    by_fact: Rate
    single: Rate
    flipped: Rate
    right_when_flipped: Rate | None
    one_right: Rate
    one_is_commoner: Rate | None
    placebo: Rate | None
    retention: Retention | None
    by: dict[str, dict[str, Rate]]
    scores: dict[str, dict[str, float]]


class Side(NamedTuple):
    """A question of a pair, with what it is paired with."""

    record: Record
    twin: TwinSide


TwinRecords = tuple[Side, Side]
"""The two records of a pair in one repetition."""


def find_pairs(records: Iterable[Record]) -> tuple[list[TwinRecords], int]:
    """Return the answered pairs of a task's records, and the number of questions in none."""
    sides = grouped(
        ((twin.pair, record.variant, record.repeat), Side(record, twin))
        for record in sorted(records, key=lambda record: record.key)
        if (twin := record.payload.twin) is not None
    )
    pairs = [(it[0], it[1]) for _, it in sorted(sides.items()) if _is_answered(it)]
    return pairs, sum(len(it) for it in sides.values() if not _is_answered(it))


def _is_answered(sides: Sequence[Side]) -> bool:
    return len(sides) == 2 and all(side.record.state == "answered" for side in sides)


def is_right(side: Side, metric: str) -> bool:
    """Return True if an answer has full marks."""
    return side.record.payload.scores.get(metric, 0.0) >= 1


def is_flipped(one: Side, other: Side) -> bool:
    """Return True if both were answered, and not the same."""
    said = {_said(one.record), _said(other.record)}
    return None not in said and len(said) == 2


def score_pairs(records: Iterable[Record], metric: str) -> list[PairScore]:
    """Return the scores of the pairs of a task under a metric, without placebos."""
    pairs = [pair for pair in find_pairs(records)[0] if not _is_placebo(pair)]
    return _pairs(pairs, metric).scores()


def summarise_pairs(
    records: Sequence[Record], metric: str, n_missing: int = 0
) -> PairSummary | None:
    """Return how the pairs of a task were answered under its main metric; None without any.

    A pair that lacks an answer is in no rate, and in the number of those that were to be answered.

    Args:
        n_missing: number of questions that a stopped run did not come to.
    """
    answered, n_incomplete = find_pairs(records)
    found = [pair for pair in answered if not _is_placebo(pair)]
    if not found:
        return None
    placebos = [pair for pair in answered if _is_placebo(pair)]
    pairs = _pairs(found, metric)
    scores = pairs.scores()
    flipped = [pair for pair in found if is_flipped(*pair)]
    one_right = [pair for pair in found if pairs.is_one_right(*pair)]
    return PairSummary(
        n_pairs=len(scores),
        n_facts=len({it.fact for it in scores}),
        n_trajectories=len({it.cluster for it in scores}),
        n_incomplete=n_incomplete,
        **pairs.rates(len(scores) + _n_lost(records, n_missing)),
        by_fact=_by_fact(scores),
        single=pairs.mean_of_worlds(pairs.is_right),
        flipped=pairs.mean(is_flipped),
        right_when_flipped=pairs.mean(pairs.are_right, flipped) if flipped else None,
        one_right=pairs.mean(pairs.is_one_right),
        one_is_commoner=_commoner(pairs, one_right) if one_right else None,
        placebo=pairs.mean(pairs.are_right, placebos) if placebos else None,
        retention=retention_of(_ladders(pairs)),
        by={facet.name: facet.means(found, pairs.net) for facet in PAIR_FACETS},
        scores=_by_trajectory(scores),
    )


def _is_placebo(pair: TwinRecords) -> bool:
    """Return True if the answer is the same in both worlds."""
    record, twin = pair[0]
    return record.payload.answers == twin.answers


def _ladders(pairs: Pairs[Side]) -> list[Ladder]:
    """Return the questions that were asked at moments, each with its net score by age."""
    scores: dict[tuple[object, ...], dict[int, list[PairShares]]] = {}
    for pair in pairs.pairs:
        record, twin = pair[0]
        if twin.age is not None:
            evidence = frozenset((side.twin.length or 0) - (side.twin.age or 0) for side in pair)
            name = (record.cluster, twin.fact, record.payload.question, record.variant, evidence)
            scores.setdefault(name, {}).setdefault(twin.age, []).append(pairs.shares(pair))
    return [Ladder(str(name[0]), _net_by_age(by_age)) for name, by_age in scores.items()]


def _net_by_age(by_age: Mapping[int, Iterable[PairShares]]) -> dict[int, float]:
    return {age: PairShares.mean(shares).net for age, shares in by_age.items()}


def _pairs(pairs: Sequence[TwinRecords], metric: str) -> Pairs[Side]:
    return Pairs(
        pairs,
        name_of=lambda side: (side.twin.pair, side.record.variant, side.twin.fact),
        cluster_of=lambda side: side.record.cluster,
        is_right=lambda side: is_right(side, metric),
        is_exchanged=lambda side: _is_right_in_twin(side, metric),
    )


def _n_lost(records: Sequence[Record], n_missing: int) -> int:
    """Return the number of pairs without an answer to one of their questions."""
    sides = grouped(
        ((record.payload.twin.pair, record.variant), record)
        for record in records
        if record.payload.twin is not None
    )
    lost = alone = 0
    for same in sides.values():
        answered = {record.id for record in same if record.state == "answered"}
        asked = {record.id for record in same}
        lost += len(asked) == 2 and len(answered) < 2
        alone += len(asked) == 1
    # A question alone has its twin among the missing ones, unless the run was to ask it alone.
    return lost + min(alone, n_missing) + (max(0, n_missing - alone) + 1) // 2


def _commoner(pairs: Pairs[Side], one_right: Sequence[TwinRecords]) -> Rate:
    """Return how often the answer that was got right is the commoner one of its form."""
    counts: dict[str, Counter[tuple[str | int | float, ...]]] = {}
    for side in pairs.worlds:
        payload = side.record.payload
        counts.setdefault(payload.question_type, Counter())[payload.answers] += 1

    def is_commoner(one: Side, other: Side) -> float:
        right, wrong = (one, other) if pairs.is_right(one) else (other, one)
        of_form = counts[right.record.payload.question_type]
        margin = of_form[right.record.payload.answers] - of_form[wrong.record.payload.answers]
        return 0.5 if margin == 0 else float(margin > 0)

    return pairs.mean(is_commoner, one_right)


def _by_trajectory(scores: Iterable[PairScore]) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    for it in scores:
        name = f"{it.pair} {it.variant}".rstrip()
        found.setdefault(it.cluster, {})[name] = it.shares.net
    return found


def _by_fact(scores: Sequence[PairScore]) -> Rate:
    """Return the mean over facts, of which each is one observation."""
    facts = grouped(((it.cluster, it.fact), it.shares) for it in scores)
    shares = list(map(PairShares.mean, facts.values()))
    return net_pairs(shares, [cluster for cluster, _ in facts])


def _is_right_in_twin(side: Side, metric: str) -> bool:
    reply = side.record.payload.reply
    if metric in SCORERS and reply is not None:
        return scores(reply, side.twin.answers)[metric] >= 1
    return side.twin.scores.get(metric, 0.0) >= 1


def _said(record: Record) -> str | None:
    """Return what a reply says, as scorers compare it; None if there is none."""
    payload = record.payload
    return None if payload.reply is None else compared_form(payload.reply, payload.answers)


def _distance(pair: TwinRecords) -> str | None:
    clues = [side.record.payload.shown_clues for side in pair]
    after = [it.n_after for it in clues if it is not None and it.n_after is not None]
    return distance_class(min(after)) if after else None


def _tokens(pair: TwinRecords) -> str | None:
    """Return the class of the tokens of frames after the last clue; each frame has as many."""
    tokens = [
        side.record.tokens.context * side.twin.n_after_clues / max(1, side.twin.n_frames)
        for side in pair
        if side.record.tokens.context is not None
        and side.twin.n_after_clues is not None
        and side.twin.n_frames is not None
    ]
    return length_class(round(min(tokens))) if tokens else None


def _shown(pair: TwinRecords) -> str | None:
    sizes = [side.twin.n_frames for side in pair]
    known = [size for size in sizes if size is not None]
    if len(known) < len(sizes):
        return None
    return next((f"<={size}" for size in _SIZES if max(known) <= size), N_SHOWN[-1])


def _difference(pair: TwinRecords) -> str | None:
    counts = [side.twin.n_differing for side in pair]
    return None if None in counts else SHOWN_DIFFERENCE[not all(counts)]


def _clues(pair: TwinRecords) -> str:
    n_clues = max(side.record.payload.n_clues for side in pair)
    return N_CLUES[min(max(n_clues, 1), len(N_CLUES)) - 1]


def _frames(name: str, pair: TwinRecords) -> str | None:
    """Return the class of a number of frames, the same on both sides, by its name in `TwinSide`."""
    n_frames = getattr(pair[0].twin, name)
    return None if n_frames is None else age_class(n_frames)


# Those by which a chart has curves of memory, in the tables' order.
_DISTANCE = Facet(
    "distance",
    "frames between the last clue and the end of the trajectory",
    _distance,
    DISTANCES,
)
_SHOWN = Facet("shown", "number of frames shown", _shown, N_SHOWN)
_AGE = Facet(
    "age",
    "frames since the newest evidence",
    partial(_frames, "age"),
    AGES,
)
MEMORY_FACETS = (_DISTANCE, _SHOWN, _AGE)
PAIR_FACETS: tuple[Facet[TwinRecords], ...] = (
    Facet("kind", "kind of edit", lambda pair: pair[0].twin.kind),
    Facet(
        "question_type",
        "type of question",
        lambda pair: pair[0].record.payload.question_type,
    ),
    _DISTANCE,
    # Of models that count tokens.
    Facet("tokens", "thousand tokens of frames shown after the last clue", _tokens, LENGTHS),
    _SHOWN,
    Facet(
        "difference",
        "whether both worlds were shown a frame that differs",
        _difference,
        SHOWN_DIFFERENCE,
    ),
    _AGE,
    Facet("span", "frames since the oldest clue", partial(_frames, "span"), AGES),
    Facet("length", "frames up to the question", partial(_frames, "length"), AGES),
    Facet("clues", "number of clue frames", _clues, N_CLUES),
)
