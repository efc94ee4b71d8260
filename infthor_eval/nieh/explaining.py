"""Why a reply got its score: what each scorer compares, and what it makes of it."""

from collections.abc import Callable, Mapping, Sequence

from infthor_eval.formats.question import Answer
from infthor_eval.nieh.numbers import number_of
from infthor_eval.nieh.prompts import last_line
from infthor_eval.nieh.scoring import (
    NEAR,
    Scorer,
    are_synonyms,
    matches_reference,
    matches_strict,
    normal_form,
    pieces_of,
    response_of,
    score,
    similarity,
    split_published,
    strict_form,
)

_YES_NO = ("yes", "no")
_LONGEST = 60  # characters of a quoted text
_FORMS: Mapping[Scorer, Callable[[Answer], str]] = {
    "reference": normal_form,
    "strict": strict_form,
}


def explain(reply: str, answers: Sequence[Answer], scorers: Sequence[Scorer]) -> list[str]:
    """Return a line for each scorer, then one for each gold answer: what it is compared with."""
    lines = []
    for scorer in scorers:
        response = last_line(reply) if scorer == "reference" else response_of(reply, answers)
        if response != reply.strip():
            what = "the last line counts" if response == last_line(reply) else "the list counts"
            lines += [told for told in [f"{what}: {_quote(response)}"] if told not in lines]
        lines.append(f"{scorer}: {score(response, answers, scorer):g}{_rule(answers, scorer)}")
        lines += [
            f"  {_find(gold, _pieces(response, answers, scorer), scorer)}" for gold in answers
        ]
    return lines


def _quote(text: str) -> str:
    """Return a text in quotes, and a long one with its beginning alone: the reply stands beside."""
    return repr(text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…")


def _rule(answers: Sequence[Answer], scorer: Scorer) -> str:
    if len(answers) == 1:
        return ""
    if scorer == "reference":
        return f" = matching pairs / {len(answers)} answers; pieces are between commas"
    return (
        f" = 2 * largest matching / ({len(answers)} answers + pieces); pieces are between commas, "
        'semicolons, slashes, "&", "and" and line ends'
    )


def _pieces(response: str, answers: Sequence[Answer], scorer: Scorer) -> list[str]:
    if len(answers) == 1:
        return [response]
    return split_published(response) if scorer == "reference" else pieces_of(response, answers)


def _find(gold: Answer, pieces: Sequence[str], scorer: Scorer) -> str:
    """Return what a gold answer is matched by, or why it is not by the piece most like it."""
    matches = matches_reference if scorer == "reference" else matches_strict
    found = [piece for piece in pieces if matches(piece, gold)]
    if found:
        return f"{str(gold)!r} is said by {_quote(found[0])}: {_why(found[0], gold, scorer)}"
    if not pieces:
        return f"{str(gold)!r} is not said: the reply is empty"
    form = _FORMS[scorer]
    nearest = max(pieces, key=lambda piece: similarity(form(piece), form(gold)))
    return f"{str(gold)!r} is not said by {_quote(nearest)}: {_why(nearest, gold, scorer)}"


def _why(piece: str, gold: Answer, scorer: Scorer) -> str:
    """Return why a piece is a gold answer to a scorer, or is not."""
    said, wanted = _FORMS[scorer](piece), _FORMS[scorer](gold)
    if scorer == "strict" and wanted in _YES_NO:
        return f"the first word must be {wanted}, and the other may not be said"
    if scorer == "strict" and number_of(gold) is not None:
        return f"the number must be {number_of(gold)}, and no other said"
    if said == wanted:
        return f"equal as {_quote(said)}"
    if are_synonyms(said, wanted):
        return f"{_quote(said)} and {wanted!r} are in one row of synonyms"
    alike = similarity(said, wanted)
    is_said = (matches_reference if scorer == "reference" else matches_strict)(piece, gold)
    if is_said and alike < NEAR:
        return f"it begins with {wanted}"  # within the first letters, to the published scorer
    reason = f"{NEAR} % are needed, and no row of synonyms has both"
    if alike >= NEAR:
        reason = f"{NEAR} % are enough" if is_said else "but their figures differ"
    return f"{_quote(said)} and {wanted!r} are {alike} % alike, {reason}"
