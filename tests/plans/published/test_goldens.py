"""Words, grounding, rewards, history and totals against what the published functions gave."""

import gzip
import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import Any

import msgspec
import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import (
    ApiAction,
    HighAction,
    LowAction,
    TaskInfo,
    TrajectorySource,
)
from infthor_eval.household.sequence_text import ACT, action_text, plan_text
from infthor_eval.plans.actors.habits import expert_texts
from infthor_eval.plans.environment import Ended
from infthor_eval.plans.history.forms import PublishedHistory
from infthor_eval.plans.history.past import Past
from infthor_eval.plans.history.segments import PlanSegment
from infthor_eval.plans.plan import plans_of, tasks_of
from infthor_eval.plans.published.paths import PublishedGraph, PublishedPaths
from infthor_eval.plans.published.rewards import (
    PublishedState,
    PublishedTask,
    Treated,
    UnscoredError,
)
from infthor_eval.plans.published.script import ground_published, published_call
from infthor_eval.plans.records import PlanRecord, StepRecord
from infthor_eval.plans.reward_rules import reward_rules
from infthor_eval.plans.summary import log_rows
from infthor_eval.thor.view import ThorObject, Vector

from ...helpers.prompts import join_parts

GOLDENS = Path(__file__).parents[3] / "../shared/data/published_goldens"
# Outputs of the same functions on inputs made for these tests.
OURS = Path(__file__).parents[2] / "goldens"
RULES = reward_rules("published")


def lines(name: str, folder: Path = GOLDENS) -> Iterator[dict[str, Any]]:
    path = folder / f"{name}.jsonl.gz"
    if not path.is_file():
        pytest.skip(f"{path} is not here")
    with gzip.open(path, "rt") as file:
        yield from map(json.loads, file)


def thing(record: dict[str, Any]) -> ThorObject:
    required = {"name": "", "position": Vector(), "objectType": record["objectId"].split("|")[0]}
    return msgspec.convert(required | record, ThorObject)


def high_action(record: dict[str, Any]) -> HighAction:
    return msgspec.convert({"high_idx": 0, **record}, HighAction)


def without_frames(parts: Iterable[Any]) -> tuple[str, list[int]]:
    """The text of parts with `<image>` for each frame, and the numbers of the frames."""
    listed = list(parts)
    frames = [int(str(part.path)) for part in listed if isinstance(part, FrameRef)]
    return join_parts(listed), frames


def test_every_text_is_the_published_one():
    put_away = (line for line in lines("put_away", OURS) if "text" in line)
    for line in chain(put_away, lines("plan_texts")):
        try:
            if "high_pddl" in line:
                text = plan_text(high_action(line["high_pddl"]), Words.PUBLISHED)
            else:
                text = action_text(msgspec.convert(line["api_action"], ApiAction), Words.PUBLISHED)
        except (DataError, msgspec.ValidationError):
            text = None
        assert text == line.get("text"), line


def test_every_text_is_grounded_as_published():
    for line in chain(lines("unreported_properties", OURS), lines("plan_grounding")):
        grounded = ground_published(line["action"], map(thing, line["objects"]))
        assert list(grounded) == line["result"], line


class _Story:
    """The states of a golden sequence; each says only what differs from the one before."""

    def __init__(self) -> None:
        self._objects: dict[str, ThorObject] = {}

    def state(self, record: dict[str, Any]) -> PublishedState:
        self._objects |= {item["objectId"]: thing(item) for item in record["objects"]}
        for key in record.get("gone", ()):
            del self._objects[key]
        held = tuple(item["objectId"] for item in record["inventoryObjects"])
        return PublishedState(
            record["lastAction"], tuple(record["pose_discrete"]), held, self._objects
        )


# A part of them each time, all of them with the slow tests.
@pytest.mark.parametrize("every", [20, 1])
def test_every_step_earns_and_ends_as_published(every):
    check_rewards(islice(lines("plan_rewards"), None, None, every))


def test_every_step_of_putting_away_earns_and_ends_as_published():
    check_rewards(line for line in lines("put_away", OURS) if "steps" in line)


def check_rewards(stories: Iterable[dict[str, Any]]) -> None:
    graphs: dict[str, PublishedGraph] = {}
    for line in stories:
        grid = json.dumps(line["grid"])
        graphs[grid] = graphs.get(grid) or PublishedGraph(map(tuple, line["grid"]))
        story = _Story()
        task = PublishedTask(
            RULES,
            msgspec.convert(line["task_info"], TaskInfo),
            list(map(high_action, line["expert_plan"])),
            line["num_subgoals"],
            PublishedPaths(graphs[grid]),
            story.state(line["start"]),
            cooled=line["flags"]["cooled_reward"],
            opened_again=line["flags"]["reopen_reward"],
        )
        for step, wanted in zip(line["steps"], line["results"], strict=False):
            state, treated = story.state(step["state"]), Treated(**step["sets"])
            if isinstance(wanted, dict):
                with pytest.raises(UnscoredError):
                    task.transition(state, treated, step["target"])
            else:
                assert list(task.transition(state, treated, step["target"])) == wanted, line["kind"]
        end = line["end"]
        assert (task.goal_index, task.goal_reached) == (end["goal_idx"], end["goal_finished"])
        assert (task.cooled, task.opened_again) == (end["cooled_reward"], end["reopen_reward"])


def read(document: dict[str, Any]) -> Any:
    """A golden trajectory, with what its lines leave out."""
    scene = {"floor_plan": "FloorPlan1"} | document["scene"]
    # Read, and not asked for.
    goal = {"goal": "pick_and_place_simple", "pickup": "Mug", "receptacle": "CounterTop"}
    tasks = [task | {"task_info": task["task_info"] | goal} for task in document["sub_tasks"]]
    parts = [part | {"sub_traj_idx": number} for number, part in enumerate(document["sub_trajs"])]
    whole = document | {"scene": scene, "sub_tasks": tasks, "sub_trajs": parts}
    return TrajectorySource(Path("golden.json"), None, json.dumps(whole).encode()).read()


def frame(number: int) -> FrameRef:
    return FrameRef(Path(str(number)))


# What the published loop logs of a step, in its order.
LOGGED = ("step", "total_reward", "agent_reward", "action", "reward", "sub_goal", "plan")


class _Loop:
    """Goes through a golden run of the published loop: the agent says what the line has, the expert
    repeats."""

    def __init__(self, line: dict[str, Any]) -> None:
        self.line, self.trajectory = line, read(line["trajectory"])
        self.plans = plans_of(self.trajectory, Words.PUBLISHED)
        self.tasks = tasks_of(self.trajectory)
        self.objects = [thing(item) for item in line["objects"]]
        self.held = next(iter(line["inventory"]), None)
        self.prompts: list[Any] = []
        self.sent: list[Any] = []
        self.records: list[PlanRecord] = []
        segments: list[PlanSegment] = []
        for place, plan in enumerate(self.plans):
            if plan.high > place:  # a sub-goal without actions ends the published loop
                break
            begins = not segments or self.plans[plan.index - 1].task != plan.task
            goal = self.tasks[plan.task].text if begins else None
            segment = PlanSegment(plan.text, goal, frame(plan.low[0]))
            acts = plan.low[1] >= line["last_step"]
            done = self.act(plan, Past(segments, segment)) if acts else None
            self.records.append(done or self.record(plan, [], Ended.DONE))
            refused = line["expert_refused"]
            if refused is not None and refused < plan.low[1]:
                break
            lows = [self.trajectory.plan.low_actions[number] for number in range(*plan.low)]
            steps = [
                (self.text(low), frame(number + 1))
                for number, low in zip(range(*plan.low), lows, strict=True)
            ]
            segments.append(PlanSegment(segment.plan, goal, segment.before, tuple(steps)))

    def text(self, low: LowAction) -> str:
        return action_text(low.api_action, Words.PUBLISHED)

    def act(self, plan: Any, past: Past) -> PlanRecord:
        parts, steps, last = [*PublishedHistory().recall(past, len), ACT], [], frame(plan.low[0])
        for number, (text, answer, reward, _, done) in enumerate(
            self.line["agent"][str(plan.high)], 1
        ):
            self.prompts.append([plan.high, *without_frames(parts)])
            try:
                call = published_call(text, self.objects, self.held)
            except LookupError:
                call = None
            self.sent.append([] if call is None else [call])
            # After an error of the service, the loop takes the last event for the present one.
            if answer == "done":
                last = frame(1000 * (plan.high + 1) + number)
            failed = answer == "refused" or call is None or "receptacleObjectId" in call
            steps.append(StepRecord(reply=text, reward=0.0 if failed else reward))
            if failed or done:
                return self.record(plan, steps, Ended.REFUSED if failed else Ended.DONE)
            parts += f"{text}{ACT}", last, ACT
        raise AssertionError("the agent said nothing more")

    def record(self, plan: Any, steps: list[StepRecord], ended: Ended) -> PlanRecord:
        expert = self.line["expert_rewards"][plan.low[0] : plan.low[1]]
        return PlanRecord(
            index=plan.high,
            kind=str(plan.kind),
            plan=plan.text,
            goal="",
            task=plan.task,
            first_step=plan.low[0],
            n_expert_steps=plan.low[1] - plan.low[0],
            expert_reward=sum(expert),
            steps=tuple(steps),
            ended=str(ended),
        )


def test_every_prompt_call_and_total_of_the_loop_is_the_published_one():
    for line in lines("plan_loop"):
        loop = _Loop(line)
        assert loop.prompts == line["prompts"]
        assert loop.sent == line["sent"]
        rows = [[getattr(row, name) for name in LOGGED] for row in log_rows(loop.records)]
        assert list(map(_rounded, rows)) == [_rounded(logged[:7]) for logged in line["log"]]


def _rounded(row: list[Any]) -> list[Any]:
    """A row whose totals are without the noise of adding in another order."""
    return [*(round(total, 9) for total in row[:3]), *row[3:]]


def by_hand(document: dict[str, Any]) -> list[tuple[str, list[int]]]:
    """Before each plan of a published file: the loop's text, and how many actions were done before
    each frame."""

    def name(object_id: str) -> str:
        return object_id[: object_id.index("|")]

    def plan_in_words(high: dict[str, Any]) -> str:
        kind, planner = high["discrete_action"]["action"], high["planner_action"]
        if kind == "GotoLocation":
            return f"go to the {high['discrete_action']['args'][0]}"
        if kind == "PutObject":
            item, place = name(planner["objectId"]), name(planner["receptacleObjectId"])
            return f"put the {item} in the {place}"
        verbs = {"PickupObject": "pick up", "CoolObject": "cool", "SliceObject": "slice"}
        return f"{verbs[kind]} the {name(planner['objectId'])}"

    def done(call: dict[str, Any]) -> str:
        ids = [call[key] for key in ("objectId", "receptacleObjectId") if key in call]
        return " ".join([call["action"], *map(name, ids)])

    text, frames, n_done, before = "", [], 0, []
    for task, part in zip(document["sub_tasks"], document["sub_trajs"], strict=True):
        text += f"<|goal|>Your main goal: {task['task_desc']}<|goal|><image>"
        frames.append(0)
        for place in range(*part["high_pddl_idx"]):
            plan = plan_in_words(document["plan"]["high_pddl"][place])
            text += f"<|plan|>Plan: {plan}<|plan|><|act|>"
            before.append((text, list(frames)))
            for low in document["plan"]["low_actions"]:
                if low["high_idx"] == place:
                    text += f"<|act|>{done(low['api_action'])}<|act|><image>"
                    n_done += 1
                    frames.append(n_done)
    assert n_done == len(document["plan"]["low_actions"])
    return before


def test_the_history_of_a_published_trajectory_is_the_published_one():
    path = GOLDENS / "floorplan28_test.json"
    if not path.is_file():
        pytest.skip(f"{path} is not here")
    wanted = by_hand(json.loads(path.read_text()))
    trajectory = TrajectorySource(path, None, path.read_bytes()).read()
    plans, tasks = plans_of(trajectory, Words.PUBLISHED), tasks_of(trajectory)
    assert len(plans) == len(wanted) == 36
    segments: list[PlanSegment] = []
    for plan, (text, numbers) in zip(plans, wanted, strict=True):
        begins = plan.index == 0 or plans[plan.index - 1].task != plan.task
        segment = PlanSegment(
            plan.text, tasks[plan.task].text if begins else None, frame(plan.low[0])
        )
        parts = PublishedHistory().recall(Past(segments, segment), len)
        assert without_frames([*parts, ACT]) == (text, numbers)
        done = zip(expert_texts(trajectory, plan, Words.PUBLISHED), range(*plan.low), strict=True)
        segments.append(
            replace(segment, steps=tuple((action, frame(number + 1)) for action, number in done))
        )
