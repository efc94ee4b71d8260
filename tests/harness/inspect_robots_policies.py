"""Policies of inspect-robots around ours."""

from pathlib import Path

import numpy as np
from inspect_robots.policy import PolicyConfig, PolicyInfo
from inspect_robots.types import Action, ActionChunk
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from model_adapters import ArmObservation, Episode, HandState, with_episodes


class OurPolicy:
    """A policy of ours as one of theirs, which takes the embodiment's spaces for its own."""

    def __init__(self, policy, folder: Path):
        self._policy = with_episodes(policy)
        self._folder = folder
        self.config = PolicyConfig()
        self.seen = []

    def bind(self, embodiment):
        self.info = PolicyInfo("ours", embodiment.action_space, embodiment.observation_space)

    def reset(self, scene):
        self._n_steps = 0
        self._policy.begin(Episode(scene.id, scene.instruction, 60))

    def act(self, observation):
        self.seen.append(observation)
        frames = [self._frame(image) for image in observation.images.values()]
        state = observation.state
        hand = HandState(
            tuple(state["eef_pos"]), tuple(state["eef_rot"]), float(state["gripper"][0])
        )
        chunk = self._policy.act(ArmObservation(*frames, state=hand, step=self._n_steps))
        self._n_steps += len(chunk)
        rows = [(*delta.translation, *delta.rotation, delta.gripper) for delta in chunk]
        return ActionChunk([Action(np.array(row)) for row in rows])

    def _frame(self, image):
        path = self._folder / f"{len(list(self._folder.iterdir())):06d}.png"
        Image.fromarray(image).save(path)
        return FrameRef(path)
