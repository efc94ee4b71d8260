"""Numbers that the libraries gave which the policies were published with: timm 0.9.16 and
transformers 4.47.0.

They are those of the tiny checkpoints of seed 0, computed by `benchmarks/reference_policies.py`,
which shares no line with the code here.
"""

import numpy as np
import pytest
import torch
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from model_adapters.policies.preprocessing import resize

from ..asking import load_saved

# A patch's features, of every 16th number: OpenVLA's as its towers give them, SpatialVLA's as Gemma
# sees them.
FEATURES = {
    "openvla": [3.8063, 4.3223, 2.4657, -9.9152, 1.4795],
    "spatialvla": [0.3502, 0.1778, 0.865, 0.7166],
}
ACTIONS = {
    "openvla": [[0.019247, -0.015948, 0.02291, -0.014184, 0.075556, -0.038771, 0.956863]],
    "spatialvla": [
        [-0.0287, -0.018464, 0.018119, -0.049564, 0.033206, 0.037781, 1.0],
        [0.009631, -0.033829, 0.002995, -0.021965, 0.016069, 0.006011, 1.0],
        [0.0283, -0.006015, 0.011651, -0.021965, 0.064857, -0.058414, 1.0],
        [-0.012688, 0.004524, 0.008489, 0.030508, 0.033206, -0.025013, 1.0],
    ],
}


@pytest.fixture(scope="module")
def frame(tmp_path_factory):
    """A pattern without symmetry."""
    path = tmp_path_factory.mktemp("pattern") / "pattern.png"
    Image.fromarray((np.arange(64 * 64 * 3) % 251).astype(np.uint8).reshape(64, 64, 3)).save(path)
    return FrameRef(path)


@torch.inference_mode()
def _features(family, network, image):
    if family == "openvla":
        values = network.weights.vision_backbone(resize(image, network.image_size)[None])
        return values
    return network.features(image)


@pytest.mark.parametrize("family", FEATURES)
def test_features_are_theirs(family, policies, frame):
    values = _features(family, policies[family]._network, frame.load())
    assert values[0, 5, ::16].tolist() == pytest.approx(FEATURES[family], abs=2e-4)


@pytest.mark.parametrize("family", ACTIONS)
def test_actions_are_theirs(family, policy_checkpoints, frame):
    policy = load_saved(family, policy_checkpoints[family], ensemble="none")
    steps = policy.act(frame, "pick up the mug")
    values = [(*step.translation, *step.rotation, step.gripper) for step in steps]
    assert np.array(values) == pytest.approx(np.array(ACTIONS[family]), abs=2e-6)
