"""The number of a set of rules moves with what they give: a run that is resumed keeps its scores.

Where one of these fails: if a reply or an episode can have another score now, the number is
another one, too (and the golden scores and digest here); if not, the digest alone. The digest is in
no run's identity, so that tidying makes no new run.
"""

import gzip
import hashlib
import itertools
import json
from pathlib import Path

import pytest

from infthor_eval.household import containment, first_place, goals, treatments
from infthor_eval.manipulation.environment import SUCCESS_RULES, ArmEnvironment
from infthor_eval.nieh import numbers, scoring
from infthor_eval.nieh.prompts import last_line
from infthor_eval.nieh.scoring import STRICT_RULES, score
from infthor_eval.plans import rewards, targets
from infthor_eval.plans.published import paths, script
from infthor_eval.plans.published import rewards as published_rewards
from infthor_eval.plans.reward_rules import reward_rules
from infthor_eval.plans.twins import looking

from .helpers.code_digests import digest_of_code
from .nieh.test_numbers import MEANT, NO_NUMBER

GOLDENS = Path(__file__).parent / "goldens"
SYNONYMS = Path(scoring.__file__).with_name("synonyms.yaml")
LISTS = ["mug\nplate", "The objects are:\n- mug\n- plate", "mug/plate & cup", "1. mug\n2. cup."]

RULES = {
    "NIEH, STRICT_RULES": (STRICT_RULES, (scoring, numbers, last_line, SYNONYMS)),
    "plans, `version` of `default` in rewards.yaml": (
        reward_rules("default").version,
        (rewards, targets, goals, treatments, containment, looking, first_place),
    ),
    "plans, `version` of `published` in rewards.yaml": (
        reward_rules("published").version,
        (published_rewards, paths, script),
    ),
    "manipulation, SUCCESS_RULES": (
        SUCCESS_RULES,
        (
            *(ArmEnvironment.step, ArmEnvironment.closing_calls, ArmEnvironment._gripper),
            *(ArmEnvironment._ending, ArmEnvironment._settle, containment),
        ),
    ),
}
KNOWN = {
    "NIEH, STRICT_RULES": ("3", "c6d20215bda257fb"),
    "plans, `version` of `default` in rewards.yaml": (1, "44e8566f72e9eafd"),
    "plans, `version` of `published` in rewards.yaml": (1, "47022a5010ab61f0"),
    "manipulation, SUCCESS_RULES": (1, "95d0eef3f130b674"),
}
GOLDEN = ("3", "8706689b01e7ae64")

CODE = """
def marks(reply, gold):
    return 1.0 if reply.strip() == gold else 0.0
"""
SAME = [
    CODE.replace("def", "import math\n\n__all__ = ['marks']\n\n\ndef"),
    CODE.replace("gold):", 'gold):\n    """Return full marks."""').replace("0.0", "0.0  # wrong"),
    CODE.replace("return 1.0", "return (\n        1.0").replace("else 0.0", "else 0.0\n    )"),
]
OTHER = [
    *(CODE.replace("0.0", "0.5"), CODE.replace("==", "!="), CODE.replace(".strip()", "")),
    *(CODE.replace("reply.strip() == gold", "True"), CODE.replace("def", "@print\ndef")),
    CODE.replace("gold):", "gold):\n    return 0.0"),
]


def test_a_digest_is_of_what_code_does(tmp_path):
    file = tmp_path / "marks.py"

    def digest(text):
        file.write_text(text)
        return digest_of_code(file)

    assert {digest(text) for text in SAME} == {digest(CODE)}
    assert len({digest(text) for text in [CODE, *OTHER]}) == 1 + len(OTHER)


@pytest.mark.parametrize("name", RULES)
def test_code_of_rules_changes_with_their_number_or_gives_the_same(name):
    number, parts = RULES[name]
    now = (number, digest_of_code(*parts))
    assert now == KNOWN[name], (
        f"the code or the number of the rules of {name} is another one. Can a score be another one "
        f"now? Then the number must be new. If not, the digest alone: {now}"
    )


def test_golden_scores_of_strict_change_with_its_number():
    replies = [(text, ["mug", "plate"]) for text in LISTS]
    for name in ("scorer_pairs", "scorer_adversarial_pairs"):
        with gzip.open(GOLDENS / f"{name}.jsonl.gz", "rt") as file:
            pairs = map(json.loads, itertools.islice(file, 0, None, 8))
            replies += [(pair["response"], pair["answers"]) for pair in pairs]
    replies += [(text, [gold]) for gold, texts in MEANT.items() for text in texts]
    replies += [(text, [gold]) for text in NO_NUMBER for gold in ("4.0", "three mugs", "2/3", 1)]
    given = [round(score(reply, answers, "strict"), 9) for reply, answers in replies]
    now = (STRICT_RULES, hashlib.sha256(repr(given).encode()).hexdigest()[:16])
    assert now == GOLDEN, f"strict scores differ: STRICT_RULES must be new, and this: {now}"
