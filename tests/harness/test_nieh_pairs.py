"""The metrics of pairs in lm-eval's own runs: as the suite counts them."""

import json

import pytest

from infthor_eval.harness.nieh_task import net_pairs, pair_accuracy, pairs_exchanged, process_pair


def _sides(pair, answers, replies, metric="net_pairs"):
    return [
        process_pair({"pair": pair, "variant": "", "answers": json.dumps([answer])}, [reply])[
            metric
        ]
        for answer, reply in zip(answers, replies, strict=True)
    ]


RIGHT = _sides("right", ("mug", "egg"), ("mug", "egg"))
EXCHANGED = _sides("exchanged", ("mug", "egg"), ("egg", "mug"))
SAME = _sides("same", ("mug", "egg"), ("mug", "mug"))
PLACEBO = _sides("placebo", ("mug", "mug"), ("mug", "mug"))


ALONE = _sides("alone", ("mug",), ("mug",))


@pytest.mark.parametrize("more", [[], PLACEBO, ALONE], ids=["", "placebo", "alone"])
def test_a_placebo_or_a_question_without_its_twin_counts_as_no_pair(more):
    sides = [*RIGHT, *EXCHANGED, *SAME, *more]
    assert pair_accuracy(sides) == pytest.approx(1 / 3)
    assert pairs_exchanged(sides) == pytest.approx(1 / 3)
    assert net_pairs(sides) == 0.0


def test_placebos_alone_are_no_pairs():
    assert net_pairs(PLACEBO) == pair_accuracy(PLACEBO) == 0.0
