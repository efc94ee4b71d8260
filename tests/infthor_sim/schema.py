"""The form of AI2-THOR 5.x metadata, as a check that names what is wrong."""

from typing import Any

XYZ = {"x": float, "y": float, "z": float}
BOX = {"cornerPoints": "corners", "center": XYZ, "size": XYZ}
POSE = {"position": XYZ, "rotation": XYZ, "localPosition": XYZ, "localRotation": XYZ}
STRINGS = "strings or null"

OBJECT: dict[str, Any] = {
    "name": str, "position": XYZ, "rotation": XYZ, "visible": bool, "isInteractable": bool,
    "receptacle": bool,
    "toggleable": bool, "isToggled": bool, "breakable": bool, "isBroken": bool,
    "canFillWithLiquid": bool,
    "isFilledWithLiquid": bool, "fillLiquid": "string or null", "dirtyable": bool, "isDirty": bool,
    "canBeUsedUp": bool, "isUsedUp": bool, "cookable": bool, "isCooked": bool, "temperature": str,
    "isHeatSource": bool, "isColdSource": bool, "sliceable": bool, "isSliced": bool,
    "openable": bool, "isOpen": bool,
    "openness": float, "pickupable": bool, "isPickedUp": bool, "moveable": bool, "mass": float,
    "salientMaterials": STRINGS, "receptacleObjectIds": STRINGS, "distance": float,
    "objectType": str,
    "objectId": str, "assetId": str, "parentReceptacles": STRINGS, "controlledObjects": STRINGS,
    "isMoving": bool,
    "axisAlignedBoundingBox": BOX, "objectOrientedBoundingBox": "box or null",
}  # fmt: skip
AGENT: dict[str, Any] = {
    "lastAction": str, "lastActionSuccess": bool, "errorMessage": str,
    "errorCode": "string or null",
    "actionReturn": "any", "isSceneAtRest": bool,
    "agent": {"name": str, "position": XYZ, "rotation": XYZ, "cameraHorizon": float,
              "isStanding": bool,
              "inHighFrictionArea": bool},
    "heldObjectPose": POSE, "hand": POSE, "arm": "any", "fov": float, "cameraPosition": XYZ,
    "cameraOrthSize": float,
    "thirdPartyCameras": list, "collided": bool, "collidedObjects": list, "inventoryObjects": list,
    "sceneName": str,
    "screenWidth": int, "screenHeight": int, "agentId": int, "depthFormat": str,
    "currentTime": float,
    "sceneBounds": BOX, "objects": list, "colors": "any",
    "colorBounds": "any", "visibleRange": "any", "flatSurfacesOnGrid": list, "distances": list,
    "normals": list,
    "isOpenableGrid": list, "segmentedObjectIds": list, "objectIdsInBox": list,
    "actionIntReturn": int,
    "actionFloatReturn": float, "actionFloatsReturn": list, "actionStringsReturn": list,
    "actionVector3sReturn": list,
}  # fmt: skip


def problems(value: Any, form: Any, where: str = "") -> list[str]:
    """What does not fit; empty when all does."""
    if isinstance(form, dict):
        if not isinstance(value, dict):
            return [f"{where}: {type(value).__name__}, not an object"]
        wrong = [f"{where}.{key}: missing" for key in form if key not in value]
        wrong += [f"{where}.{key}: not in the schema" for key in value if key not in form]
        return wrong + [
            p
            for key in form
            if key in value
            for p in problems(value[key], form[key], f"{where}.{key}")
        ]
    fits = {
        "any": lambda v: True,
        "string or null": lambda v: v is None or isinstance(v, str),
        STRINGS: lambda v: (
            v is None or (isinstance(v, list) and all(isinstance(i, str) for i in v))
        ),
        "corners": lambda v: (
            len(v) == 8 and all(len(c) == 3 and all(isinstance(x, float) for x in c) for c in v)
        ),
        "box or null": lambda v: (
            v is None or (set(v) == {"cornerPoints"} and len(v["cornerPoints"]) == 8)
        ),
    }
    good = fits[form](value) if isinstance(form, str) else type(value) is form
    return [] if good else [f"{where}: {value!r} is not {form}"]


def check(metadata: dict[str, Any]) -> None:
    wrong = problems(dict(metadata), AGENT, "metadata")
    for listed in metadata["objects"]:
        # added by the client
        item = {key: value for key, value in listed.items() if key != "visibleBounds2D"}
        wrong += problems(item, OBJECT, item.get("objectId", "?"))
        if item["temperature"] not in {"RoomTemp", "Hot", "Cold"}:
            wrong.append(f"{item['objectId']}: temperature {item['temperature']}")
        if not item["receptacle"] and item["receptacleObjectIds"] is not None:
            wrong.append(f"{item['objectId']}: receptacleObjectIds must be null")
    assert not wrong, wrong[:10]
