"""The simulator without pipes, for tests that take thousands of steps."""

from collections.abc import Iterable
from itertools import product
from typing import Any

import msgpack
import numpy as np

from infthor_sim.pictures.instances import class_color, instance_color
from infthor_sim.pictures.views import Display
from infthor_sim.player.fifo import FieldType
from infthor_sim.player.server import SimulatorServer
from infthor_sim.scenes.catalogue import Catalogue
from infthor_sim.simulation import Simulation

INIT = {"gridSize": 0.25, "visibilityDistance": 1.5, "fieldOfView": 60}


class Bench:
    """Steps a simulator in this process; replies are packed and unpacked as on the wire."""

    def __init__(self, catalogue: Catalogue | None = None, size: int = 100) -> None:
        self.sim = Simulation(catalogue or Catalogue(), Display(size, size))
        self.server = SimulatorServer(self.sim)
        self.metadata: dict[str, Any] = {}
        self.frames: dict[FieldType, bytes] = {}

    @classmethod
    def at(
        cls, scene: str, size: int = 100, catalogue: Catalogue | None = None, **init: Any
    ) -> "Bench":
        """A bench in a scene."""
        bench = cls(catalogue, size)
        bench.reset(scene, **init)
        return bench

    def reset(self, scene: str, **init: Any) -> dict[str, Any]:
        self.ok("Reset", sceneName=scene)
        return self.step("Initialize", **{**INIT, "fastActionEmit": False, **init})

    def step(self, action: str, object_id: str | None = None, **arguments: Any) -> dict[str, Any]:
        if object_id is not None:
            arguments["objectId"] = object_id
        reply = self.server.answer({"action": action, "sequenceId": 1, **arguments})
        return self.read(reply)

    def read(self, reply: Iterable[tuple[FieldType, Any]]) -> dict[str, Any]:
        """Keep what a reply says and shows."""
        self.frames = {field_type: bytes(body) for field_type, body in reply}
        self.metadata = msgpack.unpackb(self.frames[FieldType.METADATA])["agents"][0]
        return self.metadata

    def ok(self, action: str, object_id: str | None = None, **arguments: Any) -> dict[str, Any]:
        metadata = self.step(action, object_id, **arguments)
        message = f"{action} {object_id} {arguments}: {metadata['errorMessage']}"
        assert metadata["lastActionSuccess"], message
        return metadata

    def force(self, action: str, object_id: str | None = None, **arguments: Any) -> dict[str, Any]:
        return self.ok(action, object_id, forceAction=True, **arguments)

    def refused(self, action: str, object_id: str | None = None, **arguments: Any) -> str:
        metadata = self.step(action, object_id, **arguments)
        assert not metadata["lastActionSuccess"], f"{action} {object_id} {arguments} was accepted"
        return str(metadata["errorMessage"])

    def picture(self, field: FieldType = FieldType.IDS) -> np.ndarray:
        """The colours of a picture (height, width, 3), top row first."""
        display = self.sim.display
        pixels = np.frombuffer(self.frames[field], dtype=np.uint8)
        return pixels.reshape(display.height, display.width, -1)[::-1, :, :3]

    def shows(self, name: str) -> np.ndarray:
        """Where an object, by its id, or things of a class are in the picture (height, width)."""
        color = instance_color(name) if "|" in name else class_color(name)
        return (self.picture() == color).all(axis=2)

    def teleport(self, x: float, z: float, yaw: float = 0.0, horizon: float = 0.0) -> None:
        height = float(self.sim.world.agent.position[1])
        self.ok("TeleportFull", position={"x": x, "y": height, "z": z}, rotation={"y": yaw},
                horizon=horizon, standing=True)  # fmt: skip

    def object(self, object_id: str) -> dict[str, Any]:
        return next(o for o in self.metadata["objects"] if o["objectId"] == object_id)

    def first(self, object_type: str, **values: Any) -> str:
        wanted = {"objectType": object_type, **values}
        return next(o["objectId"] for o in self.metadata["objects"] if wanted.items() <= o.items())

    def stand_before(self, object_id: str) -> None:
        """Teleport the agent to a place near the object from which it sees it."""
        item = self.sim.world.objects[object_id]
        cells = sorted(
            self.sim.world.nav, key=lambda c: np.hypot(c[0] - item.center[0], c[1] - item.center[2])
        )
        height = float(self.sim.world.agent.position[1])
        turns, tilts = (0.0, 90.0, 180.0, 270.0), (0.0, 30.0, 60.0, -30.0)
        for (x, z), yaw, horizon in product(cells[:12], turns, tilts):
            pose = {"position": {"x": x, "y": height, "z": z}, "rotation": {"y": yaw}}
            stood = self.step("Teleport", **pose, horizon=horizon)["lastActionSuccess"]
            if stood and self.object(object_id)["visible"]:
                return
        raise AssertionError(f"{object_id} is visible from no place near it")
