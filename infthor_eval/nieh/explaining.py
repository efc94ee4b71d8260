"""Why a reply got its score: what each scorer compares, and what it makes of it."""

from collections.abc import Sequence

from infthor_eval.formats.question import Answer
from infthor_eval.nieh.prompts import last_line
from infthor_eval.nieh.scoring import (
    NEAR,
    Scorer,
    are_synonyms,
    is_number,
    matches_reference,
    matches_strict,
    normal_form,
    pieces_of,
    plain_form,
    score,
    similarity,
    split_published,
    without_slice,
)

__all__ = ["explain"]

_YES_NO = ("yes", "no")
_LONGEST = 60  # characters of a quoted text


def explain(reply: str, answers: Sequence[Answer], scorers: Sequence[Scorer]) -> list[str]:
    """Return a line for each scorer, then one for each gold answer: what it is compared with."""
    response = last_line(reply)
    lines = []
    if response != reply.strip():
        lines.append(f"the last line counts: {_quote(response)}")
    for scorer in scorers:
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
        'semicolons, line ends and "and"'
    )


def _pieces(response: str, answers: Sequence[Answer], scorer: Scorer) -> list[str]:
    if len(answers) == 1:
        return [response]
    return split_published(response) if scorer == "reference" else pieces_of(response)


def _find(gold: Answer, pieces: Sequence[str], scorer: Scorer) -> str:
    """Return what a gold answer is matched by, or why it is not by the piece most like it."""
    matches = matches_reference if scorer == "reference" else matches_strict
    found = [piece for piece in pieces if matches(piece, gold)]
    if found:
        return f"{str(gold)!r} is said by {_quote(found[0])}: {_why(found[0], gold, scorer)}"
    if not pieces:
        return f"{str(gold)!r} is not said: the reply is empty"
    wanted = _wanted(gold, scorer)
    nearest = max(pieces, key=lambda piece: similarity(_said(piece, scorer), wanted))
    return f"{str(gold)!r} is not said by {_quote(nearest)}: {_why_not(nearest, gold, scorer)}"


def _said(piece: str, scorer: Scorer) -> str:
    """Return a piece as the scorer compares it, where it does not look for yes, no or a number."""
    return normal_form(piece) if scorer == "reference" else without_slice(plain_form(piece.lower()))


def _wanted(gold: Answer, scorer: Scorer) -> str:
    """Return a gold answer as the scorer compares it."""
    wanted = normal_form(gold)
    return wanted if scorer == "reference" else without_slice(wanted)


def _why(piece: str, gold: Answer, scorer: Scorer) -> str:
    wanted = normal_form(gold)
    if scorer == "strict" and wanted in _YES_NO:
        return f"the first word is {wanted}, and the other is not said"
    if scorer == "strict" and is_number(wanted):
        return "the same number"
    said = _said(piece, scorer)
    wanted = _wanted(gold, scorer)
    if said == wanted:
        return f"equal as {_quote(said)}"
    alike = similarity(said, wanted)
    if said and wanted and alike >= NEAR:
        return f"{_quote(said)} and {wanted!r} are {alike} % alike, {NEAR} % are enough"
    if are_synonyms(said, wanted):
        return f"{_quote(said)} and {wanted!r} are in one row of synonyms"
    return f"it begins with {wanted}"  # within the first letters, to the published scorer


def _why_not(piece: str, gold: Answer, scorer: Scorer) -> str:
    wanted = normal_form(gold)
    if scorer == "strict" and wanted in _YES_NO:
        return f"the first word must be {wanted}, and the other may not be said"
    if scorer == "strict" and is_number(wanted):
        return f"the number must be {wanted}"
    said = _said(piece, scorer)
    wanted = _wanted(gold, scorer)
    alike = similarity(said, wanted)
    return (
        f"{_quote(said)} and {wanted!r} are {alike} % alike, {NEAR} % are needed, and no row of "
        "synonyms has both"
    )
