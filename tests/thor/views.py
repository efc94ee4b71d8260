"""Views made by hand, for tests that need no simulator."""

from infthor_eval.thor.view import AgentPose, SimulatorView, ThorObject, Vector


def thing(object_id, **fields):
    """An object where its id says."""
    parts = object_id.split("|")
    position = Vector(*(float(part) for part in parts[1:4]))
    object_type = parts[4].split("_")[0] if len(parts) > 4 else parts[0]
    defaults = {
        "name": f"{object_type}_{len(object_id)}",
        "position": position,
        "visible": True,
        **fields,
    }
    return ThorObject(object_id=object_id, object_type=object_type, **defaults)


def view(*things, inventory=()):
    """The world with these objects, after a successful action."""
    return SimulatorView(
        frame=None,
        depth=None,
        received={item.object_id: item for item in things},
        agent=AgentPose(Vector(0, 0.9, 0), 0.0, 0.0),
        inventory=tuple(inventory),
        success=True,
        error="",
        error_code="",
        result=None,
        scene="by-hand",
    )
