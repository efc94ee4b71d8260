"""The loop of the process: receive an action, act, reply with the state and the pictures asked for."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from infthor_eval.sim.actions import bind
from infthor_eval.sim.effects import settle
from infthor_eval.sim.errors import ActionError, ErrorCode
from infthor_eval.sim.fifo import FieldType, FifoPeer
from infthor_eval.sim.instances import class_image, instance_image
from infthor_eval.sim.metadata import Outcome
from infthor_eval.sim.packing import MetadataPacker
from infthor_eval.sim.render.normals import normal_image
from infthor_eval.sim.render.picture import Picture
from infthor_eval.sim.simulation import Simulation

__all__ = ["Peer"]

Frames = list[tuple[FieldType, bytes | memoryview]]
_AGENT = (FieldType.RGB, FieldType.DEPTH, FieldType.NORMALS, FieldType.IDS, FieldType.CLASSES)
_THIRD = (
    FieldType.THIRD_PARTY_RGB,
    FieldType.THIRD_PARTY_DEPTH,
    FieldType.THIRD_PARTY_NORMALS,
    FieldType.THIRD_PARTY_IDS,
    FieldType.THIRD_PARTY_CLASSES,
)


class Peer:
    """Answers one controller until it hangs up."""

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self._packer = MetadataPacker()

    def serve(self, pipes: FifoPeer) -> None:
        """Send the first state, then one reply to each action."""
        pipes.send(self._reply(Outcome("Initialize"), 0, {}))
        while (message := pipes.receive()) is not None:
            pipes.send(self.answer(message))

    def answer(self, message: Mapping[str, Any]) -> Frames:
        """The frames of the reply to one action."""
        sequence = int(message.get("sequenceId", 0))
        outcome, query = self.act(message)
        if query and self._sim.settings.fast_emit:
            return [(FieldType.METADATA_PATCH, self._packer.patch(outcome))]
        return self._reply(outcome, sequence, message)

    def act(self, message: Mapping[str, Any]) -> tuple[Outcome, bool]:
        """Does one action; how it ended, and whether it was a mere query."""
        name = str(message.get("action"))
        try:
            if message.get("renderFlowImage"):
                raise ActionError(
                    "renderFlowImage is not offered by the embedded simulator", ErrorCode.INVALID_ARGUMENT
                )
            found, arguments = bind(message, self._sim.settings.agent_mode)
            value = found.run(self._sim, **arguments)
            if not found.query:
                settle(self._sim.world)
            return Outcome(name, value=value), found.query
        except ActionError as error:
            return Outcome(name, error.message, str(error.code)), False

    def _reply(self, outcome: Outcome, sequence: int, message: Mapping[str, Any]) -> Frames:
        sim = self._sim
        wants = {
            "rgb": message.get("renderImage", True),
            "depth": message.get("renderDepthImage", sim.settings.depth),
            "normals": message.get("renderNormalsImage", sim.settings.normals),
            "ids": message.get("renderInstanceSegmentation", sim.settings.instances),
            "classes": message.get("renderSemanticSegmentation", sim.settings.classes),
        }
        segmented = bool(wants["ids"] or wants["classes"])
        frames: Frames = [(FieldType.METADATA, self._packer.message(sim, outcome, sequence, segmented))]
        frames += self._pictures(sim.agent_picture(), wants, _AGENT)
        for camera in sim.cameras:
            frames += self._pictures(sim.third_party(camera), wants, _THIRD)
        return frames

    def _pictures(self, picture: Picture, wants: Mapping[str, Any], field_types: tuple[FieldType, ...]) -> Frames:
        frames: Frames = []
        if wants["rgb"]:
            frames.append((field_types[0], self._sim.colours(picture).data))
        if wants["depth"]:
            frames.append((field_types[1], picture.depth.astype(np.float32).data))
        if wants["normals"]:
            frames.append((field_types[2], normal_image(picture).data))
        if wants["ids"]:
            frames.append((field_types[3], instance_image(picture).data))
        if wants["classes"]:
            frames.append((field_types[4], class_image(picture, self._sim.world).data))
        return frames
