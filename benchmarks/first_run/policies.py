"""The step that compares the policies' actions with those of their publication's libraries."""

import importlib.util
import socket

from .outcome import Outcome
from .work import BENCHMARKS, Work

__all__ = ["compare_policies"]

_POLICIES = ("openvla", "spatialvla")
_SAVE = (
    "import sys, pathlib; from model_adapters.tiny.{module} import {twin}; "
    "{twin}.twin.save(pathlib.Path(sys.argv[1]), seed=0)"
)
_TWINS = {"openvla": "OpenVLATiny", "spatialvla": "SpatialVLATiny"}


def compare_policies(work: Work) -> Outcome:
    """Compare actions of both policies' tiny twins on the device with the old libraries' on a
    processor."""
    verdicts = {policy: _is_equal(work, policy) for policy in _POLICIES}
    texts = [f"{policy} {'equal' if equal else 'DIFFERENT'}" for policy, equal in verdicts.items()]
    return Outcome(f"actions of random weights: {', '.join(texts)}", all(verdicts.values()))


def _is_equal(work: Work, policy: str) -> bool:
    checkpoint = work.folder / policy
    work.python("-c", _SAVE.format(module=policy, twin=_TWINS[policy]), str(checkpoint))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = [str(BENCHMARKS / "reference_policies.py"), policy, str(checkpoint)]
    words += ["--port", str(port)]
    if importlib.util.find_spec("torchvision") is None:  # then its Python half is among the others
        words.append("--without-torchvision")
    with work.server(words, port, {"PYTHONPATH": work.machine.old_libraries or ""}):
        arguments = f"pretrained={checkpoint},dtype=float32,device={work.machine.device}"
        done = work.command(
            *("check", "parity", policy, "--model-args", arguments),
            *("--reference-url", f"http://127.0.0.1:{port}"),
            codes=(0, 1),
        )
    return done.code == 0
