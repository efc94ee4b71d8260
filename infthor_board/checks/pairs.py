"""Pairs of twins, against what was shown and against single answers."""

from collections.abc import Iterator, Sequence
from typing import ClassVar

import scipy.stats

from infthor_board.case import Case
from infthor_board.expected import Expected
from infthor_board.reading import Problem
from infthor_eval.nieh.results.pair_summary import TwinRecords, find_pairs, summarise_pairs
from infthor_eval.rates import clustered_rate

_SAME = 5  # pairs with equal requests and other replies
_SAME_SHARE = 0.1
_CHANCE = 1e-6
_SINGLES = 0.9
_PAIRS = 0.05
_LEAST_PAIRS = 30


class PairsOfWhatDiffers:
    """Where both worlds were shown the same frames, greedy replies are the same."""

    name: ClassVar[str] = "pairs alike"
    reason: ClassVar[str] = "one request has one greedy reply: another one came from elsewhere"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.tasks:
            if task.run.is_export or not _is_greedy(task):
                continue
            alike = [pair for pair in find_pairs(task.graded)[0] if _is_alike(pair)]
            flipped = sum(pair.is_flipped for pair in alike)
            if flipped >= _SAME and flipped > _SAME_SHARE * len(alike):
                yield Problem(
                    self.name,
                    f"{task.name}: of {len(alike):,} pairs whose frames are the same in both "
                    f"worlds, {flipped:,} have two replies; nothing that was shown tells them "
                    "apart",
                )


class PairsOfBothWorlds:
    """Right answers in one world alone are as many in either world: a coin drew their order."""

    name: ClassVar[str] = "pairs one-sided"
    reason: ClassVar[str] = "the key of one world, given in both"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.shown:
            sides = [
                _is_first_right(task, pair)
                for pair in find_pairs(task.graded)[0]
                if sum(pair.rights("strict")) == 1
            ]
            if sides and scipy.stats.binomtest(sum(sides), len(sides)).pvalue < _CHANCE:
                yield Problem(
                    self.name,
                    f"{task.name}: of {len(sides):,} pairs with one right answer, {sum(sides):,} "
                    "are right in the first world; a coin drew which is first",
                )


class PairsWithSingles:
    """Who answers nearly all single questions from the frames tells some worlds apart."""

    name: ClassVar[str] = "pairs and singles"
    reason: ClassVar[str] = (
        "four of five answers read off the frames, and no world told from its twin"
    )

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for plain, twins in _together(case):
            singles = clustered_rate(
                [it.payload.scores.get("strict", 0.0) for it in plain.graded],
                [it.cluster for it in plain.graded],
            )
            pairs = summarise_pairs(twins.graded, "strict")
            if singles is None or pairs is None or pairs.n_pairs < _LEAST_PAIRS:
                continue
            if singles.mean >= _SINGLES and pairs.net_pairs.mean < _PAIRS:
                yield Problem(
                    self.name,
                    f"{plain.name}: {100 * singles.mean:.1f} % of single answers, and "
                    f"{100 * pairs.net_pairs.mean:.1f} % net pairs of {twins.name}, in the same "
                    "context; one of the two was not answered from frames",
                )


def _together(case: Case) -> Iterator[tuple[Expected, Expected]]:
    """Yield tasks of single questions with tasks of twins in the same context."""
    for plain in case.shown:
        for twins in case.shown:
            has_pairs = any(unit.payload.twin for unit in twins.units.values())
            is_plain = not any(unit.payload.twin for unit in plain.units.values())
            if is_plain and has_pairs and _context(plain) == _context(twins):
                yield plain, twins


def _context(task: Expected) -> str:
    return task.run.header.config.tasks[task.name].context


def _is_greedy(task: Expected) -> bool:
    return not task.run.header.config.tasks[task.name].decoding.get("temperature")


def _is_alike(pair: TwinRecords) -> bool:
    return all(side.twin.n_differing == 0 for side in pair.sides) and not any(
        side.record.payload.recall for side in pair.sides
    )


def _is_first_right(task: Expected, pair: TwinRecords) -> bool:
    worlds = task.graded_data.twins[pair.sides[0].twin.traj_id].traj_ids
    right = pair.sides[0] if pair.rights("strict")[0] else pair.sides[1]
    return right.twin.traj_id == worlds[0]
