"""Put action: "What object did you put in the fridge?"; further forms ask about several puts.

Each put has two successive frames as clues, as in Table 3: the object in the hand, and the object
where it was put.
"""

from collections.abc import Iterator, Sequence

from infthor_eval.generation.questions import candidates
from infthor_eval.generation.questions.candidates import Candidate, type_question
from infthor_eval.generation.questions.history import ObjectMove, TrajectoryHistory
from infthor_eval.grouping import grouped
from infthor_eval.household.wording import in_or_on

QUESTION_TYPE = "put_action"
FURTHER = candidates.further_type(QUESTION_TYPE)


def puts(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the questions on what was put into a container, if one put was into its type."""
    for receptacle_type, moves in sorted(_by_type(history).items()):
        move, *others = moves
        pair = history.put_clues(move)
        if not others and pair is not None:
            form = "What object did you put {}?"
            names = (in_or_on(receptacle_type),)
            yield from type_question(
                QUESTION_TYPE, form, names, pair, [move.object_type], (receptacle_type,)
            )


def further_puts(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield questions on the objects put into one receptacle, if several, and on all puts."""
    for receptacle_type, moves in sorted(_by_type(history).items()):
        if len(moves) > 1 and len({move.target for move in moves}) == 1:
            yield from _what(history, "What did you put {}?", (receptacle_type,), moves)
    yield from _what(history, "What did you put down?", (), history.moves)
    shown = ((history.target_type(move), history.put_clues(move)) for move in history.moves)
    yield from candidates.listing_question(FURTHER, "Where did you put things?", shown)


def _by_type(history: TrajectoryHistory) -> dict[str, list[ObjectMove]]:
    """Return the moves by the type of their target receptacle."""
    return grouped((history.target_type(move), move) for move in history.moves)


def _what(
    history: TrajectoryHistory, form: str, receptacles: tuple[str, ...], moves: Sequence[ObjectMove]
) -> Iterator[Candidate]:
    """Yield a question on the moved objects, with the frames of the first put of each."""
    first_puts = list({move.item: move for move in reversed(moves)}.values())[::-1]
    shown = [pair for move in first_puts if (pair := history.put_clues(move)) is not None]
    if len(shown) == len(first_puts):
        clues = tuple(frame for pair in shown for frame in pair)
        types = [move.object_type for move in first_puts]
        yield from type_question(
            FURTHER, form, tuple(map(in_or_on, receptacles)), clues, types, receptacles
        )
