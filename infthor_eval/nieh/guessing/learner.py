"""A strong guesser: logistic regression on a question's words, and on facts of its clues.

As in the stress test of test sets by Brown et al. (arXiv:2511.04655), it is trained on the
questions alone. What it gets right is there to be exploited by any model that is tuned on such a
set.
"""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.chains import form_of, words_of
from infthor_eval.nieh.guessing.clue_facts import ClueFacts
from infthor_eval.nieh.guessing.folds import Fit, Folds, split

_FORM = 100  # characters of a form: all of a text's, before each word, would grow with its square
_PLACES = (15, 100)  # frames that count as one place
# On the published files strengths from 1 to 10 differ by less than a point; no more is tuned.
_INVERSE_PENALTY = 3.0
_TOLERANCE = 1e-2
_ITERATIONS = 1000


def guess_by_learning(
    samples: Sequence[QuestionVariant],
    folds: Folds,
    *,
    number: bool,
    place: bool,
    facts: Mapping[str, Sequence[ClueFacts]] = MappingProxyType({}),
) -> Fit:
    """Return the guesser by logistic regression.

    Args:
        samples: samples on the clue frames.
        folds: their folds.
        number: whether it knows the number of clue frames.
        place: whether it knows where in the trajectory they are.
        facts: what else it knows of the clue frames, by id of the question.
    """
    from sklearn.feature_extraction import DictVectorizer  # a second to import

    features = DictVectorizer().fit_transform(
        [_features(sample, number, place, facts.get(sample.question.id, ())) for sample in samples]
    )
    answers = np.array([doc_target(sample.question) for sample in samples], dtype=object)

    def fit(out: frozenset[int]) -> dict[int, str]:
        known, unknown = split(folds, out)
        guesses = _learn(features[known], answers[known], features[unknown])
        return dict(zip(unknown, guesses, strict=True))

    return fit


def _learn(features: Any, answers: np.ndarray, unknown: Any) -> Sequence[str]:
    """Return the likeliest answers to unknown features; "" if there is nothing to learn."""
    from sklearn.linear_model import LogisticRegression
    from threadpoolctl import threadpool_limits

    if len(set(answers)) < 2:
        return [*answers[:1], ""][:1] * unknown.shape[0]
    model = LogisticRegression(C=_INVERSE_PENALTY, tol=_TOLERANCE, max_iter=_ITERATIONS)
    # These products are small: on a busy machine many threads take ten times as long as one.
    with threadpool_limits(limits=1), warnings.catch_warnings():
        # As if they were numbers to be fitted: small sets have many answers for their size.
        warnings.filterwarnings("ignore", "The number of unique classes")
        return list(model.fit(features, answers).predict(unknown))


def _features(
    sample: QuestionVariant, number: bool, place: bool, facts: Sequence[ClueFacts]
) -> dict[str, float]:
    """Return features by name, each also crossed with the form of the question."""
    form = form_of(sample.question)[:_FORM]
    words = words_of(sample.question)
    names = [*words, *(f"{first} {second}" for first, second in pairwise(words))]
    if number:
        names.append(f"#number {len(sample.frames)}")
    if place:
        names += _place_names(sample)
    names += _fact_names(facts)
    return {
        f"#form {form}": 1.0,
        **dict.fromkeys(names, 1.0),
        **{f"{form}: {name}": 1.0 for name in names},
    }


def _place_names(sample: QuestionVariant) -> Iterator[str]:
    """Yield the places of the first and the last clue, in bins of several sizes, and their span."""
    first, last = sample.frames[0], sample.frames[-1]
    yield f"#span {(last - first).bit_length()}"
    for name, frame in (("first", first), ("last", last)):
        for size in _PLACES:
            yield f"#{name} {frame // size} of {size}"
        yield f"#{name} below {1 << frame.bit_length()}"


def _fact_names(facts: Sequence[ClueFacts]) -> Iterator[str]:
    """Yield the facts of the first and the last clue, and of how many the hand is full."""
    if facts:
        yield f"#hands {sum(fact.hand_full for fact in facts)}"
        for name, fact in (("first", facts[0]), ("last", facts[-1])):
            yield f"#{name} tenth {int(10 * fact.progress)}"
            yield f"#{name} hand {fact.hand_full}"
            yield f"#{name} in view {fact.n_in_view.bit_length()}"
            yield f"#{name} at edge {fact.n_at_edge.bit_length()}"
