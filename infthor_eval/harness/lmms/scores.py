"""The metrics of lmms-eval's tasks: the scores of a reply, and those of pairs over all replies.

They equal those of our own runs on the same replies: placebos, whose answers are the same in both
worlds, count to the scores of replies and not to those of pairs.
"""

import logging
from collections.abc import Mapping, Sequence
from math import nan
from typing import Any

from infthor_eval.harness.lmms.docs import OTHER, Doc
from infthor_eval.nieh.scoring import score, scores
from infthor_eval.pairs import PAIR_BOUNDS, PairShares

Side = Mapping[str, Any]  # of a pair: a question's reply


def process_results(doc: Doc, results: Sequence[str]) -> dict[str, Any]:
    """Return both scores of a reply, and what the metrics of pairs need of it."""
    reply, answers, others = results[0], doc["answer"], doc[OTHER]
    found = scores(reply, answers)
    side = {
        "pair": doc["pair"],
        "side": doc["id"],
        "placebo": answers == others,
        "right": found["strict"] >= 1,
        "exchanged": score(reply, others, "strict") >= 1,
    }
    return found | dict.fromkeys(PAIR_BOUNDS, side)


def net_pairs(sides: Sequence[Side]) -> float:
    """Return pairs right less pairs exchanged; not a number where no pair is whole."""
    return _mean(sides, "net_pairs")


def pair_accuracy(sides: Sequence[Side]) -> float:
    """Return the share of pairs with both replies right; see `net_pairs`."""
    return _mean(sides, "pair_accuracy")


def pairs_exchanged(sides: Sequence[Side]) -> float:
    """Return the share of pairs with both replies right for the other one; see `net_pairs`."""
    return _mean(sides, "pairs_exchanged")


def _mean(sides: Sequence[Side], metric: str) -> float:
    """Return the mean of whole pairs: several processes hand their replies over in turns."""
    pairs: dict[str, dict[str, Side]] = {}
    for side in (side for side in sides if not side["placebo"]):
        pairs.setdefault(side["pair"], {})[side["side"]] = side
    whole = [list(both.values()) for both in pairs.values() if len(both) == 2]
    if len(whole) < len(pairs):
        lost = f"{len(pairs) - len(whole)} of {len(pairs)} pairs lack a reply and are left out"
        logging.getLogger(__name__).warning("%s: %s; give --limit an even number", metric, lost)
    return PairShares.mean(map(_shares, whole)).by_metric[metric] if whole else nan


def _shares(both: Sequence[Side]) -> PairShares:
    return PairShares(
        right=float(all(side["right"] for side in both)),
        exchanged=float(all(side["exchanged"] for side in both)),
    )
