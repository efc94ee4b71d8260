"""Twins for agents: two worlds of one history, and a final task that needs an object elsewhere.

The final task is to find the object and to put it somewhere. It has two sub-goals, each with its
walk, so that no plan says where the object is. In both worlds the planner carries it out.
"""

import random
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import msgspec
from msgspec.structs import replace

from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import SubTrajectory, Trajectory, encode_trajectory
from infthor_eval.formats.twins import TwinPlace, TwinWorld
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.replay import ActionReplay, ReplayReport
from infthor_eval.generation.rollout import Rollout
from infthor_eval.generation.trace import ExecutedAction, RolloutError, Trace
from infthor_eval.generation.twins.comparison import Difference, compare
from infthor_eval.generation.twins.drafting import Draft, TwinSettings, is_flipped, name_worlds
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.exchanges import Exchange
from infthor_eval.generation.twins.final_places import Errand, are_apart, errands, place_in
from infthor_eval.generation.twins.kinds import KINDS, EditKind, EditRefused, Proposal, Worlds
from infthor_eval.generation.twins.replays import Replays
from infthor_eval.generation.twins.rewriting import first_subgoals, without_traces
from infthor_eval.generation.walking import Walker
from infthor_eval.household.first_place import FirstPlace, first_place, is_looked_at
from infthor_eval.household.goals import goal_holds
from infthor_eval.household.tasks import Task, TaskType, sub_task
from infthor_eval.storage.digests import digest
from infthor_eval.storage.files import file_name, write_atomically
from infthor_eval.thor.recorder import object_log
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, teleport_call

# Kinds of edits after which an object may be far from where it is in the twin.
MOVING_KINDS = ("swap", "swap-task", "move")
TRAJECTORIES = "trajectories"  # folder in that of the set
_MOST_STEPS = 30  # of the planner to the object, so that the limit of a plan leaves time to search
_LEAST_STEPS = 40  # of the history
_TRIALS = 4  # final tasks at most that are carried out for one pair
_WORLD = "twin"  # what a world is called before it has its name
# Degrees of the agent, and of its camera, in looking around.
_HEADINGS = (0.0, 90.0, 180.0, 270.0)
_HORIZONS = (0.0, 30.0)
_MIN_PIXELS = 45  # of 90,000: half of what counts as shown


class FinalTaskDraft(Draft):
    """The twins for agents of one trajectory; `worlds` are the names of both of each pair."""

    worlds: list[tuple[str, str]] = msgspec.field(default_factory=list)


def draft_final_tasks(
    trajectory: Trajectory, base: str, settings: TwinSettings, simulator: Simulator, out: Path
) -> FinalTaskDraft:
    """Make the twins of a trajectory with final tasks, and write both worlds of each.

    Args:
        trajectory: the trajectory; its ids of objects are replaced by the simulator's.
        base: hash of its JSON.
        settings: how twins are made.
        simulator: a simulator.
        out: folder of the set.
    """
    if not trajectory.sub_trajs:
        raise DataError("it has no tasks for a final one to follow; give a long trajectory")
    draft = FinalTaskDraft(base, settings, trajectory.scene.floor_plan)
    with ExitStack() as stack:
        replays = Replays(simulator, stack)
        maker = _Maker(draft, replays.read(trajectory), replays, out)
        for name in settings.kinds:
            maker.try_kind(name)
    return draft


class _Maker:
    """Fills the draft of a trajectory."""

    def __init__(
        self, draft: FinalTaskDraft, episode: Episode, replays: Replays, out: Path
    ) -> None:
        self._draft = draft
        self._episode = episode
        self._replays = replays
        self._out = out
        self._prospects = _Prospects(episode, replays.simulator, _LEAST_STEPS)

    def try_kind(self, name: str) -> None:
        """Try the edits of a kind until enough are kept, or have been proposed."""
        settings = self._draft.settings
        kind: EditKind = KINDS.load(name, EditKind)()
        stream = f"{settings.seed}/{self._draft.digest}/{name}"
        rejected: dict[str, int] = {}
        n_proposed = 0
        n_kept = 0
        for proposal in kind.propose(self._episode, random.Random(stream)):
            if not self._prospects.may_be_needed(proposal):
                continue
            if n_proposed == 2 * settings.per_kind or n_kept == settings.per_kind:
                break
            pair_id = f"{name}-{digest(f'{stream}/{n_proposed}', 4)}"
            n_proposed += 1
            try:
                self._draft.worlds.append(self._make(proposal, name, pair_id))
                n_kept += 1
            except (EditRefused, Difference) as error:
                rejected[str(error)] = rejected.get(str(error), 0) + 1
        if n_proposed:
            self._draft.proposed[name] = n_proposed
        if rejected:
            self._draft.rejected[name] = rejected

    def _make(self, proposal: Proposal, kind: str, pair_id: str) -> tuple[str, str]:
        """Make a pair and write its worlds; return their names.

        Raises:
            EditRefused: the edit is not possible.
            Difference: the two worlds are no twins, or no final task tells them apart.
        """
        worlds = proposal.apply(self._episode, self._replays.simulator)
        if is_flipped(pair_id):
            worlds = worlds.flipped()
        one, other = (
            self._replays.replayed(without_traces(world, _WORLD)).world for world in worlds.pair
        )
        frames, _ = compare(worlds, one, other)
        histories = (
            TrajectoryHistory(_WORLD, list(one.steps)),
            TrajectoryHistory(_WORLD, list(other.steps)),
        )
        names = name_worlds(self._draft.rooms, pair_id)
        same = [frame.same for frame in frames]
        for trajectory in self._with_final_task(worlds, histories, same, kind, pair_id):
            path = self._out / TRAJECTORIES / f"{file_name(trajectory.traj_id)}.json"
            with write_atomically(path) as partial:
                partial.write_bytes(encode_trajectory(trajectory))
        return names

    def _with_final_task(
        self,
        worlds: Worlds,
        histories: tuple[TrajectoryHistory, TrajectoryHistory],
        same: Sequence[bool],
        kind: str,
        pair_id: str,
    ) -> list[Trajectory]:
        """Return both worlds with the first final task that the planner carries out in both.

        The history ends with the last sub-goal after which there is one, maybe within a task.

        Raises:
            Difference: there is none; the message is the most frequent reason.
        """
        rng = random.Random(pair_id)
        names = name_worlds(self._draft.rooms, pair_id)
        reasons: list[str] = []
        n_tried = 0
        for n_high in range(len(worlds.pair[0].plan.high_pddl), 0, -1):
            pair = [first_subgoals(world, n_high) for world in worlds.pair]
            last = len(pair[0].plan.low_actions)
            if last < _LEAST_STEPS or n_tried >= _TRIALS:
                break
            try:
                if not same[last] or not self._prospects.hides(last, sorted(worlds.changed)):
                    raise Difference("the final task begins with another view")
                fixtures = self._episode.start.objects
                for errand in errands(worlds, histories, last, fixtures, rng):
                    n_tried += 1
                    made = self._carry_out(pair, errand, reasons)
                    if made:
                        twin = partial(TwinWorld, pair_id, self._draft.digest, kind)
                        return [
                            _with_actions(run, history, twin(run.places), name)
                            for run, history, name in zip(made, histories, names, strict=True)
                        ]
            except Difference as error:
                reasons.append(str(error))
        [(reason, _)] = Counter(reasons or ["the history is too short"]).most_common(1)
        raise Difference(reason)

    def _carry_out(
        self, pair: Sequence[Trajectory], errand: Errand, reasons: list[str]
    ) -> "list[_FinalRun]":
        """Return the planner's run in both worlds; none, and a reason, if it fails in one."""
        simulator = self._replays.simulator
        try:
            return [_FinalRun(simulator, world, errand, side) for side, world in enumerate(pair)]
        except Difference as error:
            reasons.append(str(error))
            return []


class _FinalRun:
    """The planner's final task in one world.

    Attributes:
        world: the trajectory up to it.
        task: the task.
        trace: its actions and sub-goals.
        places: where the object is, and where it is in the twin.
    """

    def __init__(self, simulator: Simulator, world: Trajectory, errand: Errand, side: int) -> None:
        """Repeat the history, and carry the final task out.

        Raises:
            Difference: the object is seen without a step, or the planner fails, takes too long, or
                passes the other place first.
        """
        self.world = world
        self.places: tuple[TwinPlace, TwinPlace] = (errand.places[side], errand.places[1 - side])
        item = errand.items[side]
        replayed = ActionReplay(simulator, world, ReplayReport(_WORLD, "", ""))
        for index, low in enumerate(world.plan.low_actions):
            replayed.execute(index, low)
        receptacle = simulator.view.objects[errand.receptacle].object_type
        object_type = simulator.view.objects[item].object_type
        self.task = Task(TaskType.PLACE, object_type, receptacle)
        start = simulator.view.agent
        if item in _seen_around(simulator):
            raise Difference("the object is seen by looking around")
        self.trace = Trace(simulator, len(world.plan.high_pddl))
        rollout = Rollout(self.trace, Walker(self.trace))
        try:
            rollout.fetch(item)
            n_to_item = len(self.trace.actions)
            rollout.bring(item, errand.receptacle)
        except RolloutError as error:
            raise Difference("the planner cannot carry the final task out") from error
        if not goal_holds(self.task, simulator.view):
            raise Difference("the planner's final task does not reach its goal")
        if n_to_item > _MOST_STEPS:
            raise Difference("the object is too far away")
        self._require_direct_way(start, self.trace.actions[:n_to_item])

    def _require_direct_way(self, start: AgentPose, actions: Sequence[ExecutedAction]) -> None:
        if any(is_looked_at(start, place) for place in self.places):
            raise Difference("the agent stands at one of the places")
        if first_place(self.places, _looks(actions)) != FirstPlace.OWN:
            raise Difference("the way to the object passes its other place")


def _looks(actions: Sequence[ExecutedAction]) -> Iterator[tuple[AgentPose, str | None]]:
    for action in actions:
        api = action.low.api_action
        yield action.view.agent, api.object_id if api.action == "OpenObject" else None


def _with_actions(
    run: _FinalRun, history: TrajectoryHistory, twin: TwinWorld, name: str
) -> Trajectory:
    """Return a world with its final task, and the log of every frame."""
    world = run.world
    plan = world.plan
    actions = run.trace.actions
    n_low = len(plan.low_actions)
    final = sub_task(run.task, world.scene.floor_plan)
    ends = len(plan.high_pddl) + len(run.trace.high), n_low + len(actions)
    span = SubTrajectory(
        len(world.sub_trajs),
        (len(plan.high_pddl), ends[0]),
        (n_low, ends[1]),
        final.task_desc,
    )
    low_actions = [
        msgspec.structs.replace(action.low, low_idx=n_low + number)
        for number, action in enumerate(actions)
    ]
    whole = msgspec.structs.replace(
        world,
        plan=msgspec.structs.replace(
            plan,
            low_actions=[*plan.low_actions, *low_actions],
            high_pddl=[*plan.high_pddl, *run.trace.high],
        ),
        sub_tasks=[*world.sub_tasks, final],
        sub_trajs=[*world.sub_trajs, span],
        long_horizon_task=final,
    )
    logs: list[dict[str, Any]] = [
        msgspec.to_builtins(log)
        for log in (
            *(step.object_log for step in history.steps[: n_low + 1]),
            *(object_log(action.view) for action in actions),
        )
    ]
    return msgspec.structs.replace(without_traces(whole, name), object_log=logs, twin=twin)


class _Prospects:
    """Where the history of an episode may end, and what an agent that turns around sees there.

    Attributes:
        seen: ids of the objects that are seen by turning around, by the frame of each end.
    """

    def __init__(self, episode: Episode, simulator: Simulator, least_steps: int) -> None:
        """Carry the episode out, and look around after each sub-goal.

        Args:
            episode: the episode.
            simulator: a simulator.
            least_steps: actions of the shortest history.
        """
        self._episode = episode
        low_actions = episode.trajectory.plan.low_actions
        ends = {low.high_idx: number for number, low in enumerate(low_actions, 1)}
        report = ReplayReport(episode.trajectory.traj_id, "", "")
        replayed = ActionReplay(simulator, episode.trajectory, report)
        self.seen: Mapping[int, frozenset[str]] = {}
        seen = {}
        for number, low in enumerate(low_actions, 1):
            replayed.execute(number - 1, low)
            if number >= least_steps and number in ends.values():
                seen[number] = _seen_around(simulator)
        self.seen = seen

    def may_be_needed(self, proposal: Proposal) -> bool:
        """Return whether an edit may give a final task; of other edits than exchanges, True.

        After an exchange an object is where its partner is in the episode.
        """
        if not isinstance(proposal, Exchange):
            return True
        history = self._episode.history
        return any(
            self._fits(history, end, [proposal.partner(world, obj).object_id for world in (0, 1)])
            for obj, end in product(proposal.objects, self.seen)
            if history.is_only_one(0, obj.object_id)
        )

    def hides(self, end: int, keys: Sequence[str]) -> bool:
        """Return True if an agent at the end of a history sees none of these by turning around."""
        return not self.seen.get(end, frozenset()) & set(keys)

    def _fits(self, history: TrajectoryHistory, end: int, keys: Sequence[str]) -> bool:
        if not self.hides(end, keys) or any(s.held for s in history.states(end).values()):
            return False
        fixtures = self._episode.start.objects
        try:
            one, other = (place_in(history, end, key, fixtures) for key in keys)
        except Difference:
            return False
        return are_apart((one, other), fixtures)


def _seen_around(simulator: Simulator) -> frozenset[str]:
    """Return the ids of the objects that an agent sees that turns around where it stands."""
    start = simulator.view.agent
    seen: set[str] = set()
    for heading, horizon in product(_HEADINGS, _HORIZONS):
        pose = replace(start, rotation=heading, horizon=horizon)
        instances = simulator.query(**teleport_call(pose), renderImage=False).instances or {}
        seen |= {key for key, instance in instances.items() if instance.pixels >= _MIN_PIXELS}
    simulator.query(**teleport_call(start), renderImage=False)
    return frozenset(seen)
