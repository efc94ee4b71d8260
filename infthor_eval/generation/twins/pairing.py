"""Questions in the same words that have another answer in each of two worlds.

A question that the rules ask in one world alone is asked in the other, too, if the independent
solver answers it there from the whole log. The clues of a pair are those of both worlds together,
with which the solver must give each world's answer.

A placebo is a question of which a clue frame differs and the answer does not: who says something
else because frames differ is wrong.
"""

import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import islice

from infthor_eval.formats.question import Answer
from infthor_eval.formats.step_log import Step
from infthor_eval.formats.twins import PairedQuestion
from infthor_eval.generation.questions import counting, final_state, order, presence
from infthor_eval.generation.questions.candidates import MANY, Candidate, are_distinguishable
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.generate import candidates_of, further_candidates_of
from infthor_eval.generation.questions.history import DEFAULT_SHARE, TrajectoryHistory
from infthor_eval.household.wording import answer_of, canonical_type
from infthor_eval.storage.digests import digest

_PLACEBOS = 2  # of a pair of worlds at a moment

# Returns the strict score of a reply for gold answers, from 0 to 1.
ScoreReply = Callable[[str, Sequence[Answer]], float]


@dataclass(frozen=True)
class AskedWorld:
    """One of two worlds, with the questions that the rules ask there.

    Attributes:
        history: what happened.
        checker: the solver on its log.
        changed: ids, in this world, of the objects that may differ.
        seed: seed of the rules' draws, the same in both worlds.
    """

    history: TrajectoryHistory
    checker: Checker
    changed: frozenset[str]
    seed: int

    @classmethod
    def of(cls, steps: Sequence[Step], changed: frozenset[str], seed: int) -> "AskedWorld":
        """Return the world of a log."""
        history = TrajectoryHistory("twin", list(steps))
        return cls(history, Checker(steps, DEFAULT_SHARE), changed, seed)

    def until(self, moment: int) -> "AskedWorld":
        """Return the world as it is known after a frame."""
        return replace(self, history=self.history.until(moment), checker=self.checker.until(moment))

    def candidates(self, vocabulary: frozenset[str]) -> Mapping[str, Candidate]:
        """Return the questions that the rules ask, by their text."""
        rng = random.Random(self.seed)
        asked = candidates_of(self.history, vocabulary, rng)
        asked += [*further_candidates_of(self.history, rng), *order.orders(self.history)]
        return {candidate.text: candidate for candidate in asked}

    def sightings(self) -> Iterator[int]:
        """Yield the clearest frame of each changed object at each of its places."""
        for key in sorted(self.changed):
            by_place: dict[str, list[int]] = {}
            for frame in range(len(self.history)):
                if self.history.shows_inside(frame, key):
                    by_place.setdefault(str(self.history.parent(frame, key)), []).append(frame)
            for frames in by_place.values():
                clearest = self.history.clearest(frames, key)
                if clearest is not None:
                    yield clearest

    def says_when(self, candidate: Candidate) -> bool:
        """Return False if "how many were" could be of two moments, since something was taken away.

        The other world's frames are shown, too, so that either moment may be seen.
        """
        if candidate.form != final_state.COUNT_FORM:
            return True
        history = self.history
        last = len(history) - 1
        place = canonical_type(candidate.subjects[0])
        there = [
            key
            for key, state in history.states(last).items()
            if canonical_type(state.type) == place
        ]
        left = {key: history.contents(last, key) for key in there}
        return all(
            history.contents(frame, key) <= left[key] for key in there for frame in range(last)
        )

    def gives(self, candidate: Candidate, clues: Sequence[int]) -> bool:
        """Return True if both the whole log and these frames give a question's answer."""
        gold = sorted(map(str, candidate.answers))
        found = (self.checker.answers(candidate.text, shown) for shown in (None, clues))
        return all(answers is not None and sorted(answers) == gold for answers in found)


def pair_questions(
    worlds: tuple[AskedWorld, AskedWorld],
    types: frozenset[str],
    score: ScoreReply,
    differing: Set[int] = frozenset(),
) -> list[PairedQuestion]:
    """Return the questions on the changed fact that both worlds allow, with both answers; and
    placebos.

    Args:
        worlds: the two worlds.
        types: object types that the fact is about.
        score: the scorer.
        differing: frames that differ between the worlds; none for no placebos.
    """
    vocabulary = worlds[0].history.all_object_types | worlds[1].history.all_object_types
    asked = [world.candidates(vocabulary) for world in worlds]
    type_names = {canonical_type(name) for name in types}
    paired = []
    for text in sorted(asked[0].keys() | asked[1].keys()):
        sides = _both_sides(worlds, asked[0].get(text), asked[1].get(text), vocabulary)
        if sides is None or not _is_about(*sides, type_names):
            continue
        if not all(world.says_when(side) for world, side in zip(worlds, sides, strict=True)):
            continue
        first, second = sides
        overlap = score(_reply(first), second.answers), score(_reply(second), first.answers)
        own = score(_reply(first), first.answers), score(_reply(second), second.answers)
        if max(overlap) >= 1 or min(own) < 1:
            continue
        clues = _shared_clues(worlds, sides)
        if clues is not None:
            paired.append(_paired(sides, clues, type_names, overlap))
    return paired + list(islice(_placebos(worlds, asked, type_names, differing), _PLACEBOS))


def _placebos(
    worlds: tuple[AskedWorld, AskedWorld],
    asked: Sequence[Mapping[str, Candidate]],
    types: set[str],
    differing: Set[int],
) -> Iterator[PairedQuestion]:
    """Yield questions with one answer in both worlds of which a clue frame differs, in an order
    that says nothing."""
    for text in sorted(asked[0].keys() & asked[1].keys(), key=digest):
        sides = asked[0][text], asked[1][text]
        clues = tuple(sorted({clue for side in sides for clue in _clues_to_share(side)}))
        if (
            sides[0].answers == sides[1].answers
            and not sides[0].absence
            and not differing.isdisjoint(clues)
            and all(world.gives(side, clues) for world, side in zip(worlds, sides, strict=True))
        ):
            yield _paired(sides, clues, types, (1.0, 1.0))


def _both_sides(
    worlds: tuple[AskedWorld, AskedWorld],
    first: Candidate | None,
    second: Candidate | None,
    types: Iterable[str],
) -> tuple[Candidate, Candidate] | None:
    """Return a question as each world has it, or None if one has no clear answer."""
    if first is None and second is not None:
        first = _derived(second, worlds[0], types)
    elif second is None and first is not None:
        second = _derived(first, worlds[1], types)
    return None if first is None or second is None else (first, second)


def _derived(candidate: Candidate, world: AskedWorld, types: Iterable[str]) -> Candidate | None:
    """Return another world's question with this world's answer, by the solver, without clues."""
    if candidate.question_type == presence.QUESTION_TYPE:
        return None  # the rules know which types are like others that are there
    answers = world.checker.answers(candidate.text)
    if answers is None or len(answers) > MANY:
        return None
    by_answer = {answer_of(name): name for name in types}
    named = [by_answer[answer] for answer in answers if answer in by_answer]
    if not are_distinguishable(named):
        return None
    return replace(candidate, answers=answers, clues=())


def _is_about(first: Candidate, second: Candidate, types: set[str]) -> bool:
    """Return True if a question asks about the changed objects, or its answers differ in them.

    What else differs is a side effect.
    """
    if _types_asked_of(first) & types:
        return True
    differing = set(map(str, first.answers)) ^ set(map(str, second.answers))
    return bool(differing) and differing <= set(map(answer_of, types))


def _types_asked_of(candidate: Candidate) -> set[str]:
    """Return the object types that the words of a question name."""
    asked = {canonical_type(name) for name in candidate.subjects}
    return {name for name in asked if answer_of(name) not in set(map(str, candidate.answers))}


def _reply(candidate: Candidate) -> str:
    return ", ".join(map(str, candidate.answers))


def _shared_clues(
    worlds: tuple[AskedWorld, AskedWorld], sides: tuple[Candidate, Candidate]
) -> tuple[int, ...] | None:
    """Return frames from which both worlds' answers follow; None if the rules' clues do not do.

    No frame is evidence for an absence. For a derived question a sighting of a changed object is
    added.
    """
    own = {clue for side in sides if not side.absence for clue in _clues_to_share(side)}
    is_derived = any(not side.clues for side in sides)
    further = {frame for world in worlds for frame in world.sightings()} if is_derived else set()
    for added in (set(), *({frame} for frame in sorted(further))):
        clues = tuple(sorted(own | added))
        if all(world.gives(side, clues) for world, side in zip(worlds, sides, strict=True)):
            return clues
    return None


def _clues_to_share(side: Candidate) -> set[int]:
    """Return a question's clues; how often a thing was moved needs the frames before, too.

    In the other world it may lie there without having been moved: only the hand tells.
    """
    before = {clue - 1 for clue in side.clues if side.question_type == counting.QUESTION_TYPE}
    return {*side.clues, *before}


def _paired(
    sides: tuple[Candidate, Candidate],
    clues: tuple[int, ...],
    types: set[str],
    overlap: tuple[float, float],
) -> PairedQuestion:
    first, second = sides
    subjects = {canonical_type(name) for name in (*first.subjects, *second.subjects)}
    about = sorted((_types_asked_of(first) & types) or subjects & types)
    fact = f"{first.question_type.removesuffix('_further')}: {', '.join(about)}"
    if first.answers == second.answers:
        fact = f"placebo: {', '.join(sorted(types))}"
    return PairedQuestion(
        text=first.text,
        form=first.form,
        question_type=first.question_type,
        fact=fact,
        answers=(first.answers, second.answers),
        clues=clues,
        own_clues=(first.clues, second.clues),
        absence=(first.absence, second.absence),
        overlap=overlap,
    )


def types_of_fact(fact: str) -> set[str]:
    """Return the object types in a paired question's fact."""
    return set(fact.partition(": ")[2].split(", "))
