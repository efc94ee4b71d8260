"""Metadata as msgpack, fast: fields that do not depend on the agent are packed once per state.

Packing 70 objects of 45 fields for each reply takes longer than drawing the frame. So the packed
bytes of those fields are kept, and the few other fields are appended to the same map.
"""

import struct
from collections.abc import Sequence
from typing import Any

import msgpack
import numpy as np

from infthor_sim.geometry import Array
from infthor_sim.metadata import Outcome, agent_metadata, object_metadata
from infthor_sim.pictures.instances import class_color, instance_color
from infthor_sim.render.arm import ARM
from infthor_sim.render.body import BODY
from infthor_sim.render.hand import HAND
from infthor_sim.render.shell import SHELL_NAMES
from infthor_sim.simulation import Simulation

_DYNAMIC = 3  # fields that depend on the agent: visible, isInteractable, distance
_VISIBLE = (
    msgpack.packb("visible")
    + b"\xc3"
    + msgpack.packb("isInteractable")
    + b"\xc3"
    + msgpack.packb("distance")
)
_HIDDEN = (
    msgpack.packb("visible")
    + b"\xc2"
    + msgpack.packb("isInteractable")
    + b"\xc2"
    + msgpack.packb("distance")
)
_DOUBLE = struct.Struct(">Bd")


class MetadataPacker:
    """Packs the metadata of one simulation; keeps packed objects between replies."""

    def __init__(self) -> None:
        # version, number of fields, their bytes, by object id
        self._packed: dict[str, tuple[int, int, bytes]] = {}
        self._colors: tuple[tuple[str, ...], bytes] | None = None
        self._scene = -1  # the number of the scene whose objects are packed

    def message(
        self, sim: Simulation, outcomes: Sequence[Outcome], sequence: int, with_colors: bool
    ) -> bytes:
        """Return the METADATA body of one reply, with the outcome of each agent's last action."""
        parts = [_map_head(4), msgpack.packb("agents"), _array_head(len(outcomes))]
        for number in sim.each_agent():
            agent = agent_metadata(sim, outcomes[number])
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
        parts = [_array_head(len(reported))]
        for item, distance in zip(reported, distances, strict=True):
            entry = self._packed.get(item.object_id)
            if entry is None or entry[0] != item.version:
                fields = object_metadata(item)
                entry = (item.version, len(fields), _entries(fields))
                self._packed[item.object_id] = entry
            parts += [
                _map_head(entry[1] + _DYNAMIC),
                entry[2],
                _VISIBLE if item.object_id in visible else _HIDDEN,
            ]
            parts.append(_DOUBLE.pack(0xCB, distance))  # 0xCB: msgpack's float 64
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
