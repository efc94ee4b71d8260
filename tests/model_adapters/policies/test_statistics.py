"""Scales of actions, and which dataset's."""

import numpy as np
import pytest

from infthor_eval.errors import ModelError, UsageError
from model_adapters.policies.statistics import ActionStatistics, select_statistics

ARM = {
    "q01": [-1.0, 0, 0, 0, 0, 0, 0],
    "q99": [3.0, 1, 1, 1, 1, 1, 1],
    "mask": [True] * 6 + [False],
}
KNOWN = {"a": {"action": ARM}, "b": {"action": ARM | {"q99": [5.0, 1, 1, 1, 1, 1, 1]}}}


def test_borders_and_middle_are_scaled_and_the_gripper_passes():
    statistics = ActionStatistics(**ARM)
    written = np.array([[-1.0] * 7, [0.0] * 7, [1.0] * 7])
    # 0.5 (x + 1) (q99 - q01) + q01, by hand
    assert statistics.unnormalise(written).tolist() == [
        [-1.0, 0, 0, 0, 0, 0, -1.0],
        [1.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.0],
        [3.0, 1, 1, 1, 1, 1, 1.0],
    ]


def test_without_a_mask_all_is_scaled():
    statistics = ActionStatistics(q01=[0.0] * 7, q99=[4.0] * 7)
    assert statistics.unnormalise(np.zeros((1, 7))).tolist() == [[2.0] * 7]


def test_the_only_dataset_is_the_default():
    assert select_statistics({"a": KNOWN["a"]}, None, "mine")[0] == "a"
    key, statistics = select_statistics(KNOWN, "b", "mine")
    assert (key, statistics.q99[0]) == ("b", 5.0)


def test_of_several_one_must_be_chosen():
    with pytest.raises(
        UsageError,
        match=r"mine was trained on several datasets; choose one with unnorm_key= of a, b",
    ):
        select_statistics(KNOWN, None, "mine")


@pytest.mark.parametrize("known", [KNOWN, {"a": KNOWN["a"]}])
def test_an_unknown_dataset_lists_the_known(known):
    with pytest.raises(
        UsageError, match=r"unnorm_key=c is not a dataset of mine; there are " + ", ".join(known)
    ):
        select_statistics(known, "c", "mine")


@pytest.mark.parametrize(
    ("known", "message"),
    [
        ({"action": {"q01": [0.0] * 6, "q99": [1.0] * 6}}, r"have \[6\] numbers, not 7"),
        ({"action": {"q01": [0.0] * 7, "q99": [1.0] * 8}}, r"have \[7, 8\] numbers"),
        ({"action": {"q01": [0.0] * 7}}, "statistics of a in mine are damaged"),
        ({"action": {"q01": "left", "q99": [1.0] * 7}}, "damaged"),
        ({}, "damaged"),
    ],
)
def test_statistics_of_another_robot_or_none_are_refused(known, message):
    with pytest.raises(ModelError, match=message):
        select_statistics({"a": known}, "a", "mine")
