"""Third-party cameras, the map view, resolutions: through the real Controller."""

import numpy as np


def test_third_party_frames(kitchen):
    pose = {"position": {"x": 0, "y": 2, "z": 0}, "rotation": {"x": 60, "y": 0, "z": 0}}
    kitchen.step("AddThirdPartyCamera", **pose, fieldOfView=90)
    properties = kitchen.step("GetMapViewCameraProperties").metadata["actionReturn"]
    event = kitchen.step(action="AddThirdPartyCamera", **properties)
    frames, masks = event.third_party_camera_frames, event.third_party_instance_masks
    assert len(frames) == len(event.third_party_depth_frames) == len(masks) == 2
    above = {name.split("|")[0] for name in masks[1] if "|" in name}
    assert above >= {"CounterTop", "Fridge", "DiningTable"}
    turned = {"thirdPartyCameraId": 0, "rotation": {"x": 60, "y": 90, "z": 0}}
    moved = kitchen.step("UpdateThirdPartyCamera", **turned).third_party_camera_frames
    assert not np.array_equal(moved[0], frames[0])
    assert np.array_equal(moved[1], frames[1])
    unknown = kitchen.step("UpdateThirdPartyCamera", thirdPartyCameraId=7)
    assert not unknown.metadata["lastActionSuccess"]
    assert kitchen.reset("kitchen-1").third_party_camera_frames == []


def test_map_view_is_to_scale(kitchen):
    event = kitchen.step("ToggleMapView")
    table = next(o for o in event.metadata["objects"] if o["objectType"] == "DiningTable")
    bounds = event.metadata["sceneBounds"]["size"]
    metres_per_pixel = (max(bounds["x"], bounds["z"]) + 0.2) / 300
    x0, _, x1, _ = event.instance_detections2D[table["objectId"]]
    width = table["axisAlignedBoundingBox"]["size"]["x"]
    assert abs((x1 - x0 + 1) * metres_per_pixel - width) < 0.12
    again = kitchen.step("ToggleMapView")
    assert not np.array_equal(again.frame, event.frame)


def test_resolution_changes(kitchen):
    event = kitchen.reset("kitchen-1", width=200, height=120)
    assert event.frame.shape == (120, 200, 3)
    assert event.depth_frame.shape == (120, 200)
    assert kitchen.reset("kitchen-1", width=300, height=300).frame.shape == (300, 300, 3)


def test_frames_can_be_left_out(kitchen):
    event = kitchen.step("Pass", renderImage=False, renderDepthImage=False)
    assert event.frame is None
    assert event.depth_frame is None
    assert event.instance_masks is not None


def test_a_camera_keeps_what_is_not_given(kitchen):
    pose = {"position": {"x": 1, "y": 2, "z": 0}, "rotation": {"x": 30, "y": 40, "z": 50}}
    kitchen.step("AddThirdPartyCamera", **pose, fieldOfView=45)
    changes = {"position": {"x": 0.5, "z": 0.2}, "rotation": {"y": 90}}
    event = kitchen.step("UpdateThirdPartyCamera", **changes, fieldOfView=55)
    camera = event.metadata["thirdPartyCameras"][0]
    assert camera["position"] == {"x": 0.5, "y": 2, "z": 0.2}
    assert camera["rotation"] == {"x": 30, "y": 90, "z": 50}
    assert camera["fieldOfView"] == 55
    for angle in (-1, 0, 181):
        refused = kitchen.step("UpdateThirdPartyCamera", fieldOfView=angle)
        assert not refused.metadata["lastActionSuccess"]
        assert refused.metadata["thirdPartyCameras"] == [camera]


def test_a_camera_becomes_orthographic_and_back(kitchen):
    above = {"position": {"x": 0, "y": 2.5, "z": 0}, "rotation": {"x": 90, "y": 0, "z": 0}}
    plain = kitchen.step("AddThirdPartyCamera", **above).third_party_camera_frames[0]

    def seen(**lens):
        event = kitchen.step("UpdateThirdPartyCamera", thirdPartyCameraId=0, **lens)
        return event.third_party_camera_frames[0]

    flat = seen(orthographic=True, orthographicSize=2.0)
    assert not np.array_equal(flat, plain)
    assert not np.array_equal(seen(orthographicSize=1.0), flat)
    assert np.array_equal(seen(orthographicSize=2.0), flat)
    assert np.array_equal(seen(orthographic=False), plain)


def test_the_usual_view_from_above_looks_into_the_rooms(kitchen):
    """The recipe of ProcTHOR's scripts, and the same without the lines about perspective."""
    event = kitchen.last_event
    pose = kitchen.step("GetMapViewCameraProperties").metadata["actionReturn"]
    bounds = event.metadata["sceneBounds"]["size"]
    high = {**pose["position"], "y": pose["position"]["y"] + 1.1 * max(bounds["x"], bounds["z"])}
    lens = {"position": high, "rotation": pose["rotation"], "farClippingPlane": 50}
    flat = {key: pose[key] for key in ("orthographic", "orthographicSize")}
    perspective = {"fieldOfView": 50, "orthographic": False}
    for extra in (perspective, flat):
        more = {**extra, "skyboxColor": "white", "raise_for_failure": True}
        event = kitchen.step("AddThirdPartyCamera", **lens, **more)
        seen = event.third_party_instance_masks[-1]
        assert {name.split("|")[0] for name in seen} >= {"CounterTop", "Fridge", "Floor"}
        assert "Ceiling" not in seen


def test_clipping_planes_cut_the_picture(kitchen):
    above = {"position": {"x": 0, "y": 2.5, "z": 0}, "rotation": {"x": 90, "y": 0, "z": 0}}

    def depth(event):
        return event.third_party_depth_frames[0]

    usual = depth(kitchen.step("AddThirdPartyCamera", **above, antiAliasing="fxaa"))
    near = depth(kitchen.step("UpdateThirdPartyCamera", nearClippingPlane=2.0))
    assert usual.min() < 2 <= near.min()
    far = depth(kitchen.step("UpdateThirdPartyCamera", nearClippingPlane=0.1, farClippingPlane=2.0))
    assert np.array_equal(far < 2, usual < 2)
    for wrong in ({"nearClippingPlane": 0}, {"nearClippingPlane": 3}, {"farClippingPlane": 0.05}):
        refused = kitchen.step("UpdateThirdPartyCamera", **wrong)
        assert "clipping planes must be" in refused.metadata["errorMessage"]


def test_normals_face_the_camera(kitchen):
    kitchen.reset("kitchen-1", renderNormalsImage=True)
    kitchen.step("RotateLook", rotation=0, horizon=0)
    event = kitchen.step(
        "AddThirdPartyCamera", position={"x": 0, "y": 2, "z": 0}, rotation={"x": 90, "y": 0, "z": 0}
    )
    normals = event.normals_frame[..., :3] / 127.5 - 1
    shown = event.normals_frame[..., :3].any(axis=-1)
    assert np.allclose(np.linalg.norm(normals[shown], axis=-1), 1, atol=0.02)
    assert (normals[shown][:, 2] > -0.65).all()  # rays at the frame's corner are 39 degrees off
    assert (normals[shown][:, 2] > 0).mean() > 0.95
    floor = event.third_party_normals_frames[0][..., :3] / 127.5 - 1
    assert np.median(floor[..., 2]) > 0.98
    assert kitchen.step("Pass", renderNormalsImage=False).normals_frame is None
    kitchen.reset("kitchen-1", renderNormalsImage=False)
