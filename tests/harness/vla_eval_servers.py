"""Model servers of vla-eval around our policies and baselines."""

from pathlib import Path

import numpy as np
from PIL import Image
from vla_eval.model_servers import ModelServer

from infthor_eval.formats.frames import FrameRef
from infthor_eval.harness.vla_eval import InfthorArm
from infthor_eval.manipulation.planner.steps import plan_steps
from model_adapters import ArmObservation, Episode, HandState, with_episodes


class Watched(InfthorArm):
    """Lets a server of the same process see the world.

    Attributes:
        last: the one that was made last.
    """

    last = None

    def __init__(self, **params):
        super().__init__(**params)
        Watched.last = self


class PolicyServer(ModelServer):
    """A policy of ours as one of theirs, which is told what theirs are; theirs send float32."""

    def __init__(self, policy, folder: Path, dtype="float64", scales=(0.05, 0.5), wants=()):
        self._dtype = dtype
        self._policy = with_episodes(policy)
        self._folder = folder
        self._scales = np.repeat(scales, 3)
        self._wants = wants
        self.shown = []

    def get_observation_params(self):
        return dict.fromkeys(self._wants, True)

    async def on_episode_start(self, config, ctx):
        self._instruction = config["task"]["instruction"]
        self._n_steps = 0
        self._chunk = []
        self._policy.begin(Episode(config["task"]["name"], self._instruction, 60))

    async def on_observation(self, obs, ctx):
        if not self._chunk:
            self._chunk = self._rows(obs)
        await ctx.send_action({"actions": np.array(self._chunk.pop(0), dtype=self._dtype)})

    def _rows(self, obs):
        self.shown.append(obs)
        assert obs["task_description"] == self._instruction
        frames = [self._frame(image) for image in obs["images"].values()]
        state = None
        if "states" in obs:
            numbers = [float(number) for number in obs["states"]]
            state = HandState(tuple(numbers[:3]), tuple(numbers[3:6]), numbers[7])
        chunk = self._policy.act(ArmObservation(*frames, state=state, step=self._n_steps))
        self._n_steps += len(chunk)
        return [self._row(delta) for delta in chunk]

    def _row(self, delta):
        moved = np.array((*delta.translation, *delta.rotation)) / self._scales
        return (*moved, 1 - 2 * delta.gripper)

    def _frame(self, image):
        path = self._folder / f"{len(list(self._folder.iterdir())):06d}.png"
        Image.fromarray(image).save(path)
        return FrameRef(path)


class PlannerServer(ModelServer):
    """The planner, which knows where everything is; it gives calls, and none when it gives up."""

    async def on_episode_start(self, config, ctx):
        self._steps = plan_steps(Watched.last.world.environment)

    async def on_observation(self, obs, ctx):
        await ctx.send_action({"calls": list(next(self._steps, []))})


class SameServer(ModelServer):
    """Gives the same action again and again."""

    def __init__(self, action):
        self._action = action

    async def on_observation(self, obs, ctx):
        await ctx.send_action(self._action)
