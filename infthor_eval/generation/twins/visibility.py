"""Whether an eye sees in the pictures what differs: objects, actions, the answer to a question."""

from collections.abc import Iterator, Sequence

from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.step_log import ObjectInFrame, Step
from infthor_eval.formats.twins import PairedQuestion
from infthor_eval.generation.twins.comparison import Difference, World
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.pairing import AskedWorld, types_of_fact
from infthor_eval.generation.twins.pictures import are_clearly_unlike
from infthor_eval.household.wording import canonical_type


def check_insertions(world: World, inserted: range) -> None:
    """Check that each inserted action changes the picture: a door may open out of the frame.

    Raises:
        Difference: one does not.
    """
    for index in inserted:
        if not are_clearly_unlike(world.files[index], world.files[index + 1]):
            raise Difference("an action that is added cannot be seen")


def check_original(
    has_own: bool, episode: Sequence[Step], first: AskedWorld, second: AskedWorld
) -> None:
    """Check that frames do not tell an original.

    Where one world is the episode's own, they show as many of the changed objects in one as in the
    other: edits of objects that the episode shows are proposed first, so a world that hides one
    would be the edited one. Else each world's show objects at other sizes than the episode's.

    Raises:
        Difference: they tell it.
    """
    n_seen, n_seen_there = (len(one.changed & one.history.seen) for one in (first, second))
    if has_own and n_seen != n_seen_there:
        raise Difference("one world shows a changed object that the other hides")
    own = [step.seen for step in episode]
    if not has_own and own in ([step.seen for step in one.steps] for one in (first, second)):
        raise Difference("a world looks as the episode does")


def is_shown(question: PairedQuestion, worlds: Worlds, first: World, second: World) -> bool:
    """Return True if a clue frame shows an eye which of the two worlds it is.

    It must show that by the changed object that is asked about, if any frame that differs shows it:
    another one that is changed with it may be beside it.
    """
    differing = [clue for clue in question.clues if first.pictures[clue] != second.pictures[clue]]
    shown = {clue: list(_asked(question, worlds, first, second, clue)) for clue in differing}
    any_shown = any(shown.values())
    return any(
        bool(seen) == any_shown and are_clearly_unlike(first.files[clue], second.files[clue], seen)
        for clue, seen in shown.items()
    )


def _asked(
    question: PairedQuestion, worlds: Worlds, first: World, second: World, clue: int
) -> Iterator[ObjectInFrame]:
    """Yield how both pictures of a clue frame show the changed objects that are asked about."""
    types = types_of_fact(question.fact)
    for world, changed in ((first, worlds.changed), (second, worlds.changed_in_second)):
        seen = world.steps[clue].seen or {}
        for key in changed & seen.keys():
            if canonical_type(object_type_of(key)) in types:
                yield seen[key]
