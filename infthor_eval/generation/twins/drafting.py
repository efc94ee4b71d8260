"""Making the twins of one trajectory: edits are proposed, applied, replayed, compared and asked.

What passes is a draft: all pairs of worlds with all their questions, of which a set has a choice.
An eye must see in the pictures what differs: objects, actions, the answer to a question.
"""

import random
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from itertools import chain
from pathlib import Path

import msgspec
from msgspec.structs import replace

from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.step_log import ObjectInFrame, Step
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.formats.twins import ComparedFrame, PairedQuestion, TwinPair
from infthor_eval.generation.twins.comparison import Difference, World, compare
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.kinds import KINDS, EditKind, EditRefused, Proposal, Worlds
from infthor_eval.generation.twins.pairing import (
    AskedWorld,
    ScoreReply,
    pair_questions,
    types_of_fact,
)
from infthor_eval.generation.twins.pictures import are_clearly_unlike
from infthor_eval.generation.twins.replays import WORLD, Replayed, Replays
from infthor_eval.generation.twins.rewriting import without_traces
from infthor_eval.generation.twins.rungs import farthest_first, ladders, stretches, that_stay
from infthor_eval.generation.twins.tolerance import tolerance_of
from infthor_eval.household.wording import canonical_type
from infthor_eval.storage.digests import digest
from infthor_eval.storage.files import file_name
from infthor_eval.thor.simulator import Simulator


class TwinSettings(msgspec.Struct, frozen=True):
    """How twins are made.

    Attributes:
        kinds: names of the kinds of edits.
        seed: seed of all that is drawn.
        per_kind: twins with questions of one kind and trajectory, at most; twice as many are
            proposed.
        rungs: numbers of frames since the evidence at which questions are asked, ascending; none
            for the end of the episode.
    """

    kinds: tuple[str, ...]
    seed: int = 0
    per_kind: int = 2
    rungs: tuple[int, ...] = ()


class Draft(msgspec.Struct):
    """What was made of one trajectory.

    Attributes:
        digest: hash of the trajectory's JSON.
        settings: how it was made.
        rooms: scene of the trajectory.
        proposed: number of proposed edits by kind.
        rejected: number of rejected edits by kind and reason.
    """

    digest: str
    settings: TwinSettings
    rooms: str
    proposed: dict[str, int] = msgspec.field(default_factory=dict)
    rejected: dict[str, dict[str, int]] = msgspec.field(default_factory=dict)


class TwinDraft(Draft):
    """The twins of one trajectory; `pairs` are those that were kept and have questions."""

    pairs: list[TwinPair] = msgspec.field(default_factory=list)


def draft_twins(
    trajectory: Trajectory,
    base: str,
    settings: TwinSettings,
    score: ScoreReply,
    simulator: Simulator,
    out: Path,
) -> TwinDraft:
    """Make the twins of a trajectory, and write the worlds of those with questions into a set.

    Args:
        trajectory: the trajectory; its ids of objects are replaced by the simulator's.
        base: hash of its JSON.
        settings: how twins are made.
        score: the strict score of a reply.
        simulator: a simulator.
        out: folder of the set.
    """
    draft = TwinDraft(base, settings, trajectory.scene.floor_plan)
    with ExitStack() as stack:
        replays = Replays(simulator, stack)
        episode = replays.read(trajectory)
        parts = stretches(episode) if settings.rungs else (episode,)
        makers = [_Maker(draft, part, score, replays, out) for part in parts]
        for name in settings.kinds:
            n_kept = 0
            for maker in makers:
                if n_kept < settings.per_kind:  # what the whole has too few of, its parts may have
                    n_kept += maker.try_kind(name, settings.per_kind - n_kept)
    return draft


class _Maker:
    """Fills the draft of a trajectory."""

    def __init__(
        self, draft: TwinDraft, episode: Episode, score: ScoreReply, replays: Replays, out: Path
    ) -> None:
        self._draft = draft
        self._episode = episode
        self._score = score
        self._replays = replays
        self._out = out

    def try_kind(self, name: str, n_wanted: int) -> int:
        """Try the edits of a kind until enough have questions, or have been proposed; return how
        many have."""
        settings = self._draft.settings
        kind: EditKind = KINDS.load(name, EditKind)()
        stream = f"{settings.seed}/{self._draft.digest}/{name}"
        if not self._episode.is_whole:
            stream += f"/{len(self._episode.history)}"
        rng = random.Random(stream)
        rejected = self._draft.rejected.setdefault(name, {})
        pairs: list[TwinPair] = []
        n_proposed = 0
        proposals: Iterable[Proposal] = kind.propose(self._episode, rng)
        if settings.rungs:
            proposals = farthest_first(proposals, self._episode, settings.rungs)
        for proposal in proposals:
            if n_proposed == 2 * n_wanted or len(pairs) == n_wanted:
                break
            pair_id = f"{name}-{digest(f'{stream}/{n_proposed}', 4)}"
            n_proposed += 1
            try:
                pair = self._try(proposal, name, pair_id)
            except (EditRefused, Difference) as error:
                rejected[str(error)] = rejected.get(str(error), 0) + 1
            else:
                pairs += [pair] if pair.tells_worlds else []
        if n_proposed:
            self._draft.proposed[name] = self._draft.proposed.get(name, 0) + n_proposed
        if not rejected:
            del self._draft.rejected[name]
        self._draft.pairs += pairs
        return len(pairs)

    def _try(self, proposal: Proposal, kind: str, pair_id: str) -> TwinPair:
        """Make one pair, and write its worlds if it has questions.

        Raises:
            EditRefused: the edit is not possible.
            Difference: the two worlds are no twins.
        """
        worlds = proposal.apply(self._episode, self._replays.simulator)
        if is_flipped(pair_id):
            worlds = worlds.flipped()
        replays = [self._replays.replayed(without_traces(one, WORLD)) for one in worlds.pair]
        tolerance = tolerance_of(self._replays.simulator)
        first, second = (replayed.world for replayed in replays)
        frames, displaced = compare(worlds, first, second, tolerance)
        for world in (first, second):
            _check_insertions(world, worlds.inserted)
        seed = self._draft.settings.seed
        asked = (
            AskedWorld.of(first.steps, worlds.changed, seed),
            AskedWorld.of(second.steps, worlds.changed_in_second, seed),
        )
        check_original(worlds.has_own, self._episode.history.steps, *asked)
        questions = self._ask(asked, worlds, frames)
        names = name_worlds(self._draft.rooms, pair_id)
        pair = TwinPair(
            id=pair_id,
            kind=kind,
            seed=seed,
            base=self._draft.digest,
            traj_ids=names,
            floor_plan=self._draft.rooms,
            ids=worlds.ids,
            changed=tuple(sorted(worlds.changed)),
            displaced=tuple(sorted(displaced)),
            types=tuple(sorted(worlds.types)),
            frames=frames,
            questions=tuple(one for one in questions if is_shown(one, worlds, first, second)),
        )
        if pair.tells_worlds:
            self._write(worlds, pair, replays)
        return pair

    def _ask(
        self,
        asked: tuple[AskedWorld, AskedWorld],
        worlds: Worlds,
        frames: Sequence[ComparedFrame],
    ) -> list[PairedQuestion]:
        """Return the questions at the end; or those at the rungs of ladders, and placebos."""
        rungs = self._draft.settings.rungs
        if not rungs:
            return pair_questions(asked, worlds.types, self._score)
        differing = {at for at, frame in enumerate(frames) if not frame.same}

        def ask_at(moment: int) -> list[PairedQuestion]:
            until = asked[0].until(moment), asked[1].until(moment)
            found = pair_questions(until, worlds.types, self._score, differing)
            return [replace(question, moment=moment) for question in found]

        asked_of: dict[str, list[PairedQuestion]] = {}
        for ladder in ladders(frames, rungs):
            climbed: dict[str, list[PairedQuestion]] = {}
            for question in that_stay(list(map(ask_at, ladder))):
                climbed.setdefault(f"{question.text} {question.answers}", []).append(question)
            # With the same answers it would be asked once more on younger evidence.
            asked_of = {**climbed, **asked_of}
        return list(chain.from_iterable(asked_of.values()))

    def _write(self, worlds: Worlds, pair: TwinPair, replays: Sequence[Replayed]) -> None:
        first, second = (replayed.world.files for replayed in replays)
        # What counts as equal is one picture, so that no noise tells the worlds apart.
        shared = [
            one if frame.same else other
            for frame, one, other in zip(pair.frames, first, second, strict=True)
        ]
        pictures = (first, shared)
        for side, replayed in enumerate(replays):
            world = without_traces(worlds.pair[side], pair.traj_ids[side])
            replayed.write(self._out, world, pictures[side])


def is_flipped(pair_id: str) -> bool:
    """Return whether a pair's worlds change places, so that the first is not always the episode."""
    return random.Random(pair_id).random() < 0.5


def name_worlds(rooms: str, pair_id: str) -> tuple[str, str]:
    """Return the names of a pair's trajectories, which tell nothing but the rooms."""
    first, second = (f"{file_name(rooms)}-{digest(f'{pair_id}/{side}', 4)}" for side in (0, 1))
    return first, second


def _check_insertions(world: World, inserted: range) -> None:
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
    if not has_own and own in (
        [step.seen for step in one.history.steps] for one in (first, second)
    ):
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
