"""The process's loop: receive an action, run it, reply with metadata and requested pictures."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from infthor_sim.actions import bind
from infthor_sim.effects import apply_sources
from infthor_sim.errors import ActionError, ErrorCode
from infthor_sim.metadata import Outcome
from infthor_sim.pictures.instances import class_image, instance_image
from infthor_sim.player.fifo import FieldType, FifoPipes
from infthor_sim.player.packing import MetadataPacker
from infthor_sim.render.normals import normal_image
from infthor_sim.render.picture import Picture
from infthor_sim.settings import PHYSICS_STEP
from infthor_sim.simulation import Simulation

Frames = Iterator[tuple[FieldType, bytes | memoryview]]
_AGENT = (FieldType.RGB, FieldType.DEPTH, FieldType.NORMALS, FieldType.IDS, FieldType.CLASSES)
_STARTS = ("Reset", "Initialize")
_THIRD = (
    FieldType.THIRD_PARTY_RGB,
    FieldType.THIRD_PARTY_DEPTH,
    FieldType.THIRD_PARTY_NORMALS,
    FieldType.THIRD_PARTY_IDS,
    FieldType.THIRD_PARTY_CLASSES,
)


class SimulatorServer:
    """Answers one controller until it hangs up."""

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self._packer = MetadataPacker()
        # of each agent's last action, by its id: a reply tells them all
        self._outcomes: dict[int, Outcome] = {}

    def serve(self, pipes: FifoPipes) -> None:
        """Send the first state, then one reply to each action."""
        # The client waits for a state before it sends its first action, as Unity sends one when it
        # has started.
        pipes.send(self._reply(0, {}))
        while (message := pipes.receive()) is not None:
            pipes.send(self.answer(message))

    def answer(self, message: Mapping[str, Any]) -> Frames:
        """Run one action and return the frames of the reply, which are made as they are asked for.

        So the client reads the metadata while the pictures are drawn.
        """
        sequence = int(message.get("sequenceId", 0))
        outcome, query = self.run(message)
        if message.get("action") in _STARTS:
            self._outcomes.clear()
        sim = self._sim
        # The agent may be gone with the scene that it was in.
        sim.world.active = self._agent_of(message) or 0
        self._outcomes[sim.world.active] = outcome
        # Unity's fast emit: after a query the client keeps its last frame and gets only what the
        # action returned.
        if query and sim.settings.fast_emit:
            patch = self._packer.patch(outcome, sim.world.active)
            return iter([(FieldType.METADATA_PATCH, patch)])
        return self._reply(sequence, message)

    def _agent_of(self, message: Mapping[str, Any]) -> int | None:
        """Return the id of the agent that a message is for; None if the scene has no such agent."""
        number = message.get("agentId") or 0
        known = type(number) is int and 0 <= number < len(self._sim.world.agents)
        return number if known else None

    def run(self, message: Mapping[str, Any]) -> tuple[Outcome, bool]:
        """Run one action; return its outcome, and whether it succeeded as a query."""
        name = str(message.get("action"))
        try:
            if message.get("renderFlowImage"):
                raise ActionError(
                    "renderFlowImage is not offered by the embedded simulator",
                    ErrorCode.INVALID_ARGUMENT,
                )
            agent_id = self._agent_of(message)
            if agent_id is None:
                raise ActionError(
                    f"there is no agent with agentId {message['agentId']}; the scene has "
                    f"{len(self._sim.world.agents)} (agentCount of Initialize)",
                    ErrorCode.INVALID_ARGUMENT,
                )
            self._sim.world.active = agent_id
            action, arguments = bind(message, self._sim.settings.agent_mode)
            value = action.run(self._sim, **arguments)
            if not action.query:
                apply_sources(self._sim.world)
                self._sim.time += PHYSICS_STEP
            return Outcome(name, value=value), action.query
        except ActionError as error:
            self._sim.time += PHYSICS_STEP
            return Outcome(name, error.message, str(error.code)), False

    def _reply(self, sequence: int, message: Mapping[str, Any]) -> Frames:
        sim = self._sim
        outcomes = [
            self._outcomes.get(number, Outcome("Initialize"))
            for number in range(len(sim.world.agents))
        ]
        # An argument of the action decides about its own reply, else what Initialize set.
        requested = {
            "rgb": message.get("renderImage", True),
            "depth": message.get("renderDepthImage", sim.settings.depth),
            "normals": message.get("renderNormalsImage", sim.settings.normals),
            "ids": message.get("renderInstanceSegmentation", sim.settings.instances),
            "classes": message.get("renderSemanticSegmentation", sim.settings.classes),
        }
        segmented = bool(requested["ids"] or requested["classes"])
        yield FieldType.METADATA, self._packer.message(sim, outcomes, sequence, segmented)
        if not any(requested.values()):
            return
        for _ in sim.each_agent():
            yield from self._pictures(sim.views.agent_frame(), requested, _AGENT)
        for camera in sim.cameras:
            yield from self._pictures(sim.views.third_party(camera), requested, _THIRD)

    def _pictures(
        self, picture: Picture, requested: Mapping[str, Any], field_types: tuple[FieldType, ...]
    ) -> Frames:
        if requested["rgb"]:
            yield field_types[0], self._sim.views.colours(picture).data
        if requested["depth"]:
            yield field_types[1], picture.depth.astype(np.float32).data
        if requested["normals"]:
            yield field_types[2], normal_image(picture).data
        if requested["ids"]:
            yield field_types[3], instance_image(picture).data
        if requested["classes"]:
            yield field_types[4], class_image(picture, self._sim.world).data
