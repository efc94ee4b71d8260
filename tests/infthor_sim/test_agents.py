"""Several agents in one scene: their replies, what they see, hold and run into."""

import math
from collections.abc import Iterable
from typing import Any

import msgpack
import pytest

from infthor_sim import Controller
from infthor_sim.pictures.instances import class_color
from infthor_sim.player.fifo import FieldType

from .harness import Bench


class Crew(Bench):
    """A bench of two agents in a kitchen; it keeps what replies say of each."""

    def __init__(self, **init: Any) -> None:
        super().__init__()
        self.agents: list[dict[str, Any]] = []
        self.reset("kitchen-1", **{"agentCount": 2, **init})

    def read(self, reply: Iterable[tuple[FieldType, Any]]) -> dict[str, Any]:
        frames = [(field_type, bytes(body)) for field_type, body in reply]
        self.frames = dict(frames)
        self.listed = [body for field_type, body in frames if field_type == FieldType.RGB]
        message = msgpack.unpackb(self.frames[FieldType.METADATA])
        self.agents = message["agents"]
        self.metadata = self.agents[message["activeAgentId"]]
        return self.metadata

    def place(self, agent_id: int, x: float, z: float, yaw: float = 0.0) -> None:
        self.ok(
            "Teleport",
            agentId=agent_id,
            position={"x": x, "y": self.sim.world.standing_height, "z": z},
            rotation={"y": yaw},
            horizon=0,
        )


@pytest.fixture
def crew() -> Crew:
    return Crew()


def at(metadata: dict[str, Any]) -> tuple[float, float]:
    position = metadata["agent"]["position"]
    return position["x"], position["z"]


def test_a_reply_tells_every_agent_its_own_last_action(crew):
    crew.ok("RotateRight", agentId=1)
    crew.ok("LookDown")
    assert [a["lastAction"] for a in crew.agents] == ["LookDown", "RotateRight"]
    assert [a["agentId"] for a in crew.agents] == [0, 1]
    assert [a["agent"]["rotation"]["y"] for a in crew.agents] == [270.0, 0.0]
    assert [a["agent"]["cameraHorizon"] for a in crew.agents] == [30.0, 0.0]
    assert len(crew.listed) == 2
    assert crew.listed[0] != crew.listed[1]
    crew.ok("Initialize", agentCount=2, fastActionEmit=False)
    assert [a["lastAction"] for a in crew.agents] == ["Initialize", "Initialize"]


def test_agents_start_apart_and_a_reset_leaves_one(crew):
    assert math.dist(*map(at, crew.agents)) >= 0.4
    crew.step("Initialize", agentCount=6, fastActionEmit=False)
    places = [at(a) for a in crew.agents]
    assert len(places) == 6
    assert min(math.dist(a, b) for i, a in enumerate(places) for b in places[:i]) >= 0.4
    crew.ok("Reset", sceneName="kitchen-2", agentId=1)
    assert len(crew.agents) == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"agentCount": 7}, "agentCount must be 1 to 6, not 7"),
        ({"agentCount": 0}, "agentCount must be 1 to 6, not 0"),
        ({"agentCount": 2, "agentMode": "arm"}, "agentCount must be 1 with agentMode 'arm', not 2"),
    ],
)
def test_counts_that_are_not_offered_are_refused(crew, arguments, message):
    assert crew.refused("Initialize", **arguments) == message
    assert crew.metadata["errorCode"] == "InvalidArgument"


def test_a_room_without_place_for_all_is_refused():
    bench = Bench.at("Procedural")
    bench.sim.world.nav = type(bench.sim.world.nav)([(0.0, 0.0), (0.25, 0.0)])
    assert bench.refused("Initialize", agentCount=2) == "there is room for 1 agents, not for 2"
    assert bench.ok("RotateRight")["agent"]["rotation"]["y"] == 90.0


@pytest.mark.parametrize("agent_id", [2, -1, "1", 1.5, True])
def test_an_agent_that_is_not_there_is_refused(crew, agent_id):
    assert "there is no agent with agentId" in crew.refused("MoveAhead", agentId=agent_id)
    assert crew.metadata["errorCode"] == "InvalidArgument"


def test_agents_see_one_another(crew):
    crew.place(0, 0.0, 0.0)
    crew.place(1, 0.0, 1.0, 180.0)
    crew.step("Pass", renderInstanceSegmentation=True)
    assert crew.shows("Agent").any()
    assert {"name": "Agent", "color": list(class_color("Agent"))} in crew.metadata["colors"]
    before = crew.listed
    crew.ok("MoveAhead", agentId=1)
    assert crew.listed[0] != before[0]  # it has come nearer
    crew.ok("Initialize", agentCount=2, makeAgentsVisible=False, fastActionEmit=False)
    crew.place(1, 0.0, 1.0, 180.0)
    crew.step("Pass", renderInstanceSegmentation=True)
    assert not crew.shows("Agent").any()


def test_third_party_cameras_see_all_agents(crew):
    crew.place(0, 0.0, 0.0)
    crew.place(1, 0.0, 0.75)
    middle = {"x": 0.0, "y": 2.4, "z": 0.375}
    down = {"x": 90}
    crew.ok("AddThirdPartyCamera", position=middle, rotation=down, renderInstanceSegmentation=True)
    bodies = (crew.picture(FieldType.THIRD_PARTY_IDS) == class_color("Agent")).all(axis=2)
    assert min(bodies[:50].sum(), bodies[50:].sum()) > 50
    assert [len(a["thirdPartyCameras"]) for a in crew.agents] == [1, 1]


def test_an_agent_is_in_the_way_of_another(crew):
    crew.place(0, 0.0, 0.0)
    crew.place(1, 0.0, 0.75)
    crew.ok("MoveAhead")
    message = "Agent 1 is blocking Agent 0 from moving by (0.0000, 0.0000, 0.2500)."
    assert crew.refused("MoveAhead") == message
    assert crew.refused("MoveAhead", moveMagnitude=0.5).startswith("Agent 1 is blocking Agent 0")
    assert crew.refused("MoveBack", agentId=1).startswith("Agent 0 is blocking Agent 1")
    taken = {"x": 0.0, "y": crew.sim.world.standing_height, "z": 0.5}
    message = "Cannot teleport due to hitting object 'Agent 1'."
    assert crew.refused("Teleport", position=taken) == message
    crew.ok("MoveAhead", allowAgentsToIntersect=True)
    assert "is blocking" in crew.refused("MoveAhead")
    crew.ok("MoveBack")  # away is free
    reachable = crew.ok("GetReachablePositions")["actionReturn"]
    others = at(crew.agents[1])
    assert min(math.dist((p["x"], p["z"]), others) for p in reachable) >= 0.4


def test_each_agent_has_its_own_hand(crew):
    egg = crew.first("Egg")
    apple = crew.first("Apple")
    crew.force("PickupObject", egg)
    assert crew.refused("PickupObject", egg, forceAction=True, agentId=1) == (
        f"{egg} is in the hand of another agent"
    )
    crew.force("PickupObject", apple, agentId=1)
    held = [a["inventoryObjects"][0]["objectId"] for a in crew.agents]
    assert held == [egg, apple]
    before = crew.object(egg)["position"]
    crew.ok("RotateRight", agentId=1)
    assert crew.object(egg)["position"] == before
    assert crew.refused("TeleportObject", egg, position={}, rotation={}, agentId=1) == (
        "Cannot teleport object in hand."
    )
    crew.ok("DropHandObject", agentId=1)
    assert [len(a["inventoryObjects"]) for a in crew.agents] == [1, 0]
    crew.force("PickupObject", apple, agentId=1)
    crew.ok("Initialize", agentCount=1, fastActionEmit=False)
    assert not crew.object(apple)["isPickedUp"]
    assert crew.object(egg)["isPickedUp"]


def test_visible_and_distance_are_each_agents_own(crew):
    egg = crew.first("Egg")
    crew.force("PickupObject", egg)
    seen = [{o["objectId"]: o for o in a["objects"]}[egg] for a in crew.agents]
    assert seen[0]["visible"]
    assert seen[0]["distance"] < seen[1]["distance"]


def test_a_saved_state_has_all_agents(crew):
    crew.ok("SaveState", slot=1)
    before = [at(a) for a in crew.agents]
    crew.ok("MoveAhead", agentId=1)
    crew.ok("RestoreState", slot=1, agentId=1)
    assert [at(a) for a in crew.agents] == before
    assert crew.metadata["agentId"] == 1


def test_ai2thor_makes_an_event_of_each_agents_part():
    with Controller(scene="kitchen-1", agentCount=2, renderDepthImage=True) as controller:
        event = controller.step("RotateRight", agentId=1)
        assert [e.metadata["agentId"] for e in event.events] == [0, 1]
        assert event.metadata is event.events[1].metadata
        assert event.events[0].depth_frame.shape == (300, 300)
        assert (event.events[0].frame != event.events[1].frame).any()
        reply = controller.step("GetReachablePositions", agentId=1)
        assert reply.metadata["agentId"] == 1
        assert len(reply.metadata["actionReturn"]) > 50
        with pytest.raises(ValueError, match="there is no agent with agentId 2; the scene has 2"):
            controller.step("Pass", agentId=2)
