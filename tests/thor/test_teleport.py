from infthor_eval.thor.view import AgentPose, Vector, teleport_call

POSE = AgentPose(Vector(1.0, 0.9, -2.0), 90.0, 30.0, standing=False)


def test_the_call_puts_the_agent_at_the_pose():
    assert teleport_call(POSE, force=False) == {
        "action": "TeleportFull",
        "position": {"x": 1.0, "y": 0.9, "z": -2.0},
        "rotation": {"x": 0.0, "y": 90.0, "z": 0.0},
        "horizon": 30.0,
        "standing": False,
        "forceAction": False,
    }


def test_an_agent_that_cannot_crouch_is_not_told_to_stand():
    # Unity's arm agents refuse the argument.
    assert "standing" not in teleport_call(AgentPose(POSE.position, 0.0, 0.0, standing=None))
