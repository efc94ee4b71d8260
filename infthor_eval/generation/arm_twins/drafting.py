"""Making the arm twins of one trajectory: both worlds are carried out, drawn, compared, asked."""

import random
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from msgspec.structs import replace

from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import (
    ApiAction,
    DiscreteAction,
    ExpertPlan,
    LowAction,
    Scene,
    Trajectory,
)
from infthor_eval.formats.twins import ArmChoice, ComparedFrame, PairedQuestion, TwinPair
from infthor_eval.generation.arm_twins.bringing import Brought, Errand, bring, errands, left_one
from infthor_eval.generation.twins.comparison import Difference
from infthor_eval.generation.twins.drafting import TwinDraft, TwinSettings, is_flipped, name_worlds
from infthor_eval.generation.twins.kinds import EditRefused
from infthor_eval.generation.twins.replays import WORLD, Replays
from infthor_eval.generation.twins.rewriting import without_traces
from infthor_eval.household.wording import in_or_on
from infthor_eval.storage.digests import digest
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView

KIND = "bring"
_MOST_ERRANDS = 48  # that are tried in one trajectory's rooms
_SIDES = ("left", "right")
_AROUND = ("RotateRight",) * 4
_AND_BACK = ("RotateLeft", "RotateRight")
_ORDER = ("first", "last")

# Whether an arm can pick up both things, by their ids, from where the agent stands in a view.
Reaches = Callable[[Scene, SimulatorView, tuple[str, str]], bool]


def draft_arm_twins(
    trajectory: Trajectory,
    base: str,
    settings: TwinSettings,
    reaches: Reaches,
    simulator: Simulator,
    out: Path,
) -> TwinDraft:
    """Make arm twins in the rooms of a trajectory, and write their worlds into a set.

    Args:
        trajectory: the trajectory, of which the start alone is used.
        base: hash of its JSON.
        settings: how twins are made; `per_kind` is how many.
        reaches: whether an arm reaches both things.
        simulator: a simulator.
        out: folder of the set.
    """
    draft = TwinDraft(base, settings, trajectory.scene.floor_plan)
    if restore(simulator, trajectory.scene).lines():
        raise DataError("its start cannot be restored; give a trajectory that replays here")
    stream = f"{settings.seed}/{base}/{KIND}"
    rng = random.Random(stream)
    rejected: dict[str, int] = {}
    used: set[str] = set()
    for number, errand in enumerate(errands(simulator.view, rng)[:_MOST_ERRANDS]):
        if len(draft.pairs) == settings.per_kind:
            break
        names = {thing.name for thing in errand.things}
        if names & used:
            continue  # other things, so that facts vary
        draft.proposed[KIND] = draft.proposed.get(KIND, 0) + 1
        pair_id = f"{KIND}-{digest(f'{stream}/{number}', 4)}"
        maker = _Maker(draft, errand, pair_id, reaches, simulator, out)
        try:
            draft.pairs.append(maker.make(trajectory.scene, rng))
            used |= names
        except (EditRefused, Difference) as error:
            rejected[str(error)] = rejected.get(str(error), 0) + 1
    if rejected:
        draft.rejected[KIND] = rejected
    return draft


@dataclass(frozen=True)
class _World:
    """A world as it is written: what was brought, and the steps added before it."""

    brought: Brought
    added: tuple[str, ...]

    @property
    def clues(self) -> tuple[int, ...]:
        """The frames before each thing is picked up and after it is put down, in order."""
        n = len(self.added)
        taken, put = self.brought.taken, self.brought.put
        return (taken[0] + n, put[0] + n + 1, taken[1] + n, put[1] + n + 1)

    def trajectory(self, name: str) -> Trajectory:
        """Return the world as a trajectory."""
        low = [
            LowAction(ApiAction(action), 0, DiscreteAction(f"{action}_90")) for action in self.added
        ]
        low += [action.low for action in self.brought.trace.actions]
        numbered = [replace(action, low_idx=number) for number, action in enumerate(low)]
        plan = ExpertPlan(numbered, list(self.brought.trace.high))
        return without_traces(Trajectory(self.brought.scene, plan), name)


@dataclass(frozen=True)
class _Asked:
    """A question: its form, the instruction, and which thing is meant in each world."""

    form: str
    instruction: str
    things: tuple[int, int]


@dataclass(frozen=True)
class _Maker:
    """Makes a pair."""

    draft: TwinDraft
    errand: Errand
    pair_id: str
    reaches: Reaches
    simulator: Simulator
    out: Path

    def make(self, scene: Scene, rng: random.Random) -> TwinPair:
        """Return the pair, whose worlds are written.

        Raises:
            EditRefused: the rooms do not allow it.
            Difference: the worlds end with other pictures.
        """
        brought = bring(self.errand, scene, self.simulator, rng)
        if not self.reaches(brought[0].scene, brought[0].view, brought[0].things):
            raise EditRefused("an arm does not reach both things")
        lengths = [len(one.trace.actions) for one in brought]
        first, second = (
            _World(one, _wait(max(lengths) - length))
            for one, length in zip(brought, lengths, strict=True)
        )
        worlds = (second, first) if is_flipped(self.pair_id) else (first, second)
        asked = self._ask(worlds, rng, is_exchanged=worlds[0] is second)
        names = name_worlds(self.draft.rooms, self.pair_id)
        with ExitStack() as stack:
            replays = Replays(self.simulator, stack)
            made = [replays.replayed(world.trajectory(WORLD)) for world in worlds]
            one, other = (replayed.world.pictures for replayed in made)
            frames = tuple(ComparedFrame(a == b) for a, b in zip(one, other, strict=True))
            if not all(frame.same for frame in frames[-first.brought.tail - 1 :]):
                raise Difference("a picture of the way back differs")
            for side, (world, replayed) in enumerate(zip(worlds, made, strict=True)):
                choices = [self._choice(worlds, question, side) for question in asked]
                whole = replace(world.trajectory(names[side]), arm_choices=choices)
                replayed.write(self.out, whole, replayed.world.files)
        ids = dict(zip(*(world.brought.things for world in worlds), strict=True))
        return TwinPair(
            id=self.pair_id,
            kind=KIND,
            seed=self.draft.settings.seed,
            base=self.draft.digest,
            traj_ids=names,
            floor_plan=self.draft.rooms,
            ids=ids,
            changed=tuple(sorted(worlds[0].brought.things)),
            displaced=(),
            types=tuple(sorted(thing.object_type for thing in self.errand.things)),
            frames=frames,
            questions=tuple(self._paired(worlds, question) for question in asked),
        )

    def _ask(
        self, worlds: tuple[_World, _World], rng: random.Random, *, is_exchanged: bool
    ) -> list[_Asked]:
        """Return a question about a place, and one about the order, each drawn of two."""
        place = rng.randrange(2)
        words = in_or_on(self.errand.places[place].object_type)
        there = (1 - place, place) if is_exchanged else (place, 1 - place)
        at = rng.randrange(2)
        first, second = (world.brought.order[at] for world in worlds)
        return [
            _Asked("place", f"pick up the one that was {words}", there),
            _Asked("order", f"pick up the one that you put down {_ORDER[at]}", (first, second)),
        ]

    def _paired(self, worlds: tuple[_World, _World], asked: _Asked) -> PairedQuestion:
        first, second = worlds
        left = left_one(first.brought.view, first.brought.things)
        one, other = (_SIDES[thing != left] for thing in asked.things)
        name = asked.form
        return PairedQuestion(
            text=f'You put two things down here. Which one is meant by "{asked.instruction}": the '
            "left or the right one?",
            form=f"arm {name}",
            question_type=f"arm {name}",
            fact=name,
            answers=((one,), (other,)),
            clues=tuple(sorted({*first.clues, *second.clues})),
            own_clues=(first.clues, second.clues),
            absence=(False, False),
            overlap=(0.0, 0.0),
        )

    def _choice(self, worlds: tuple[_World, _World], asked: _Asked, side: int) -> ArmChoice:
        things = worlds[side].brought.things
        thing = asked.things[side]
        return ArmChoice(
            pair=f"{self.pair_id}/{asked.form}",
            base=self.draft.digest,
            instruction=asked.instruction,
            target=things[thing],
            other=things[1 - thing],
        )


def _wait(n: int) -> tuple[str, ...]:
    """Return so many steps, an even number, after which the agent stands as before."""
    return _AROUND * (n // 4) + _AND_BACK * (n % 4 // 2)
