"""The packages vla-eval and websockets, which are set aside, and servers that speak to them."""

import os
import sys
import threading
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters import ArmObservation, Episode, HandState, load

PACKAGES = Path(os.environ.get("VLA_EVAL_PACKAGES", f"{sys.prefix}/vla-eval"))
OWN = ("vla_eval", "websockets", "lazyregistry")
HAND = HandState((0.4, -0.1, 0.3), (0.1, 0.2, 0.3), 1.0)


@pytest.fixture(scope="package")
def vla_eval():
    """The package, for as long as these tests take; other packages take websockets if they see
    it."""
    if not PACKAGES.is_dir():
        pytest.skip("vla-eval is not set aside (make test does it)")
    sys.path.append(str(PACKAGES))
    import vla_eval

    yield vla_eval
    sys.path.remove(str(PACKAGES))
    for name in [name for name in sys.modules if name.partition(".")[0] in OWN]:
        del sys.modules[name]


@pytest.fixture
def at_once(monkeypatch):
    """No waiting between attempts, nor for a server that is to close a connection."""
    from model_adapters.remote_policies import sessions

    monkeypatch.setattr(sessions, "_FIRST_WAIT_S", 0.001)
    monkeypatch.setattr(sessions, "_CLOSE_S", 0.05)


@pytest.fixture(scope="session")
def shot(tmp_path_factory):
    """What is seen and felt: a view, one from the wrist, a hand."""
    folder = tmp_path_factory.mktemp("shot")
    draw = np.random.default_rng(0)
    refs = []
    for name in ("view", "wrist"):
        Image.fromarray(draw.integers(0, 256, (8, 6, 3), dtype=np.uint8)).save(
            folder / f"{name}.png"
        )
        refs.append(FrameRef(folder / f"{name}.png"))
    return ArmObservation(refs[0], refs[1], HAND)


@pytest.fixture
def connect(vla_eval, at_once):
    """Loads an adapter with options; it is closed in the end."""
    with ExitStack() as stack:

        def connect(name, url, **options):
            given = {"url": url, "timeout_s": 30, **options}
            policy = load(name, {key: str(value) for key, value in given.items()}, 0)
            stack.callback(policy.close)
            return policy

        yield connect


@pytest.fixture
def websocket_server(vla_eval):
    """Starts a server that a function answers for: it gets a connection, and its number from 1."""
    with ExitStack() as stack:

        def start(answer):
            from websockets.exceptions import ConnectionClosed
            from websockets.sync.server import serve

            numbers = iter(range(1, 1000))

            def handle(connection):
                try:
                    answer(connection, next(numbers))
                except ConnectionClosed:
                    return  # the client has gone

            server = stack.enter_context(serve(handle, "127.0.0.1", 0, compression=None))
            thread = threading.Thread(target=server.serve_forever, daemon=True)
            thread.start()
            return f"ws://127.0.0.1:{server.socket.getsockname()[1]}"

        yield start


def run(policy, shots, instruction="pick up the mug", name="e"):
    """The chunks of an episode."""
    policy.begin(Episode(name, instruction, 10))
    chunks = [policy.act(shot) for shot in shots]
    policy.end(success=True)
    return chunks


def refusal(call, *args, **kwargs):
    """The one line in which a call is refused."""
    with pytest.raises(ModelError) as caught:
        call(*args, **kwargs)
    assert "\n" not in str(caught.value)
    assert type(caught.value) is ModelError
    return str(caught.value)
