"""The simulator without pipes, for tests that take thousands of steps."""

from typing import Any

import msgpack
import numpy as np

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

    def reset(self, scene: str, **init: Any) -> dict[str, Any]:
        assert self.step("Reset", sceneName=scene)["lastActionSuccess"], self.metadata[
            "errorMessage"
        ]
        return self.step("Initialize", **{**INIT, "fastActionEmit": False, **init})

    def step(self, action: str, **arguments: Any) -> dict[str, Any]:
        reply = self.server.answer({"action": action, "sequenceId": 1, **arguments})
        self.frames = {field_type: bytes(body) for field_type, body in reply}
        self.metadata = msgpack.unpackb(self.frames[FieldType.METADATA])["agents"][0]
        return self.metadata

    def ok(self, action: str, **arguments: Any) -> dict[str, Any]:
        metadata = self.step(action, **arguments)
        assert metadata["lastActionSuccess"], f"{action} {arguments}: {metadata['errorMessage']}"
        return metadata

    def refused(self, action: str, **arguments: Any) -> str:
        metadata = self.step(action, **arguments)
        assert not metadata["lastActionSuccess"], f"{action} {arguments} was accepted"
        return str(metadata["errorMessage"])

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
        for x, z in cells[:12]:
            for yaw in (0.0, 90.0, 180.0, 270.0):
                for horizon in (0.0, 30.0, 60.0, -30.0):
                    self.step(
                        "Teleport",
                        position={"x": x, "y": height, "z": z},
                        rotation={"y": yaw},
                        horizon=horizon,
                    )
                    if self.metadata["lastActionSuccess"] and self.object(object_id)["visible"]:
                        return
        raise AssertionError(f"{object_id} is visible from no place near it")
