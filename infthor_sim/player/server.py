"""The process's loop: receive an action, run it, reply with metadata and requested pictures."""

import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import msgpack
import numpy as np

from infthor_sim.actions import bind
from infthor_sim.effects import apply_sources
from infthor_sim.errors import ActionError, ErrorCode
from infthor_sim.geometry import Array
from infthor_sim.metadata import Outcome, agent_metadata, object_metadata
from infthor_sim.pictures.instances import class_color, class_image, instance_color, instance_image
from infthor_sim.player.fifo import FieldType, FifoPipes
from infthor_sim.render.arm import ARM
from infthor_sim.render.body import BODY
from infthor_sim.render.hand import HAND
from infthor_sim.render.picture import Picture, normal_image
from infthor_sim.render.shell import SHELL_NAMES
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
_FLOAT = b"\xcb"  # msgpack's head of a float 64, whose eight bytes follow, the highest first
_DYNAMIC = 3  # fields that depend on the agent: visible, isInteractable, distance
_VISIBLE = (
    msgpack.packb("visible")
    + b"\xc3"
    + msgpack.packb("isInteractable")
    + b"\xc3"
    + msgpack.packb("distance")
    + _FLOAT
)
_HIDDEN = (
    msgpack.packb("visible")
    + b"\xc2"
    + msgpack.packb("isInteractable")
    + b"\xc2"
    + msgpack.packb("distance")
    + _FLOAT
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
        further = {}
        if message.get("imageDigest"):
            further["imageDigest"] = sim.views.digest_of_colours(sim.views.agent_frame())
        yield (
            FieldType.METADATA,
            self._packer.message(sim, outcomes, sequence, segmented, further),
        )
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


class MetadataPacker:
    """Packs the metadata of one simulation as msgpack; keeps packed objects between replies.

    Packing 70 objects of 45 fields for each reply takes longer than drawing the frame. So the
    packed bytes of the fields that do not depend on the agent are kept, and the few other fields
    are appended to the same map.
    """

    def __init__(self) -> None:
        # version, and the bytes of a map up to its fields that depend on the agent, by object id
        self._packed: dict[str, tuple[int, bytes]] = {}
        self._colors: tuple[tuple[str, ...], bytes] | None = None
        self._scene = -1  # the number of the scene whose objects are packed

    def message(
        self,
        sim: Simulation,
        outcomes: Sequence[Outcome],
        sequence: int,
        with_colors: bool,
        further: Mapping[str, Any],
    ) -> bytes:
        """Return the METADATA body of one reply, with the outcome of each agent's last action.

        `further` is what only this simulator tells, of the active agent's frame.
        """
        parts = [_map_head(4), msgpack.packb("agents"), _array_head(len(outcomes))]
        for number in sim.each_agent():
            agent = {**agent_metadata(sim, outcomes[number]), **further}
            parts += [_map_head(len(agent) + 2), _entries(agent)]
            parts += [msgpack.packb("objects"), *self._objects(sim)]
            parts += [msgpack.packb("colors"), self._color_list(sim) if with_colors else b"\xc0"]
        top = {
            "sequenceId": sequence,
            "activeAgentId": sim.world.active,
            "thirdPartyCameras": agent["thirdPartyCameras"],
        }
        parts.append(_entries(top))
        return b"".join(parts)

    def patch(self, outcome: Outcome, agent_id: int) -> bytes:
        """Return the METADATA_PATCH body of one reply, for an action that changed nothing."""
        return _packed({**outcome.fields(), "agentId": agent_id})

    def _objects(self, sim: Simulation) -> list[bytes]:
        if self._scene != sim.n_loaded:
            self._packed.clear()
            self._scene = sim.n_loaded
        visible = sim.vision.visible_ids()
        reported = sim.reported_objects()
        positions: Array = np.array([o.position for o in reported]).reshape(-1, 3)
        distances = np.linalg.norm(positions - sim.world.agent.position, axis=1)
        numbers = distances.astype(">f8").tobytes()
        parts = [_array_head(len(reported))]
        for number, item in enumerate(reported):
            entry = self._packed.get(item.object_id)
            if entry is None or entry[0] != item.version:
                fields = object_metadata(item)
                entry = item.version, _map_head(len(fields) + _DYNAMIC) + _entries(fields)
                self._packed[item.object_id] = entry
            seen = _VISIBLE if item.object_id in visible else _HIDDEN
            parts += (entry[1], seen, numbers[8 * number : 8 * number + 8])
        return parts

    def _color_list(self, sim: Simulation) -> bytes:
        ids = tuple(sim.world.objects)
        agent: tuple[str, ...] = (HAND,) if sim.world.arm is None else (ARM,)
        if len(sim.world.agents) > 1:
            agent = (*agent, BODY)
        if self._colors is None or self._colors[0] != (*ids, *agent):
            types = sorted(
                {o.object_type for o in sim.world.objects.values()} | {*SHELL_NAMES, *agent}
            )
            colors: list[dict[str, Any]] = [
                {"name": i, "color": list(instance_color(i))} for i in ids
            ]
            colors += [{"name": t, "color": list(class_color(t))} for t in types]
            self._colors = ((*ids, *agent), msgpack.packb(colors))
        return self._colors[1]


def _entries(fields: dict[str, Any]) -> bytes:
    """Return the packed keys and values of a map, without its head."""
    return _packed(fields)[len(_map_head(len(fields))) :]


def _packed(fields: dict[str, Any]) -> bytes:
    """Return a packed map; half a pair of code units, which an error may quote, is written out."""
    packed: bytes = msgpack.packb(fields, unicode_errors="backslashreplace")
    return packed


def _map_head(size: int) -> bytes:
    return bytes([0x80 | size]) if size < 16 else struct.pack(">BH", 0xDE, size)


def _array_head(size: int) -> bytes:
    return bytes([0x90 | size]) if size < 16 else struct.pack(">BH", 0xDC, size)
