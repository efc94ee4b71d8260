"""Measure the speed of an arm through the real Controller, of several simulators together, and of
tiny policies.

    python benchmarks/arm_speed.py [--steps 200] [--simulators 4]

An arm moves to and fro in a kitchen, with and without frames. Then several simulators do so at the
same time, each in a thread. Each tiny policy acts on such a frame.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.thor.frames import FrameFolder
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator
from model_adapters import ArmDelta, Policy, load

_SCENE = "kitchen-1"
_POLICIES = ("openvla-tiny", "spatialvla-tiny")
_ACTS = 10


def main() -> None:
    """Print one line for each measurement."""
    options = _arguments()
    single = 0.0
    for image in (True, False):
        with _simulator(image) as simulator:
            rate = steps_per_second(simulator, options.steps)
            single = single if not image else rate
            print(f"arm, {'frames' if image else 'no frames'}: {rate:.0f} steps/s", flush=True)
    together = steps_per_second_together(options.simulators, options.steps)
    print(
        f"arm, frames, {options.simulators} simulators: {together:.0f} steps/s, "
        f"{together / single:.2f} times one"
    )
    with tempfile.TemporaryDirectory() as folder, _simulator(True) as simulator:
        frame = FrameFolder(Path(folder)).keep(simulator.view)
        assert frame is not None
        for name in _POLICIES:
            policy = load(name, {}, 0)
            assert isinstance(policy, Policy)
            policy.reset()
            policy.act(frame, "pick up the mug")
            seconds = seconds_per_call(
                lambda policy=policy: policy.act(frame, "pick up the mug"), _ACTS
            )
            print(f"{name}: {1 / seconds:.1f} chunks/s, {1000 * seconds:.0f} ms each", flush=True)
            policy.close()


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=200, help="steps of each simulator")
    parser.add_argument("--simulators", type=int, default=4, help="simulators at the same time")
    return parser.parse_args()


def _simulator(image: bool) -> Simulator:
    simulator = Simulator(embedded_launch(), image=image, instances=False, agentMode="arm")
    simulator.reset(_SCENE)
    simulator.step("MoveArmBase", y=0.8)
    return simulator


def steps_per_second(simulator: Simulator, n_steps: int) -> float:
    """Return the rate of steps of 5 cm to and fro, each with a translation and a wrist rotation
    like a policy's."""
    conversion = Conversion()

    def step(number: int) -> None:
        sign = (-1.0) ** number
        for call in conversion.calls(
            ArmDelta((sign * 0.03, 0.0, sign * 0.04), (0.0, 0.0, sign * 0.1), 0.0)
        ):
            simulator.step(**call)

    step(0)
    start = time.perf_counter()
    for number in range(1, n_steps + 1):
        step(number)
    return n_steps / (time.perf_counter() - start)


def steps_per_second_together(n_simulators: int, n_steps: int) -> float:
    """Return the total rate of several simulators."""
    simulators = [_simulator(True) for _ in range(n_simulators)]
    try:
        start = time.perf_counter()
        with ThreadPoolExecutor(n_simulators) as pool:
            list(pool.map(lambda simulator: steps_per_second(simulator, n_steps), simulators))
        return n_simulators * n_steps / (time.perf_counter() - start)
    finally:
        for simulator in simulators:
            simulator.close()


def seconds_per_call(do: Callable[[], object], n_times: int) -> float:
    """Return the mean seconds of a call."""
    start = time.perf_counter()
    for _ in range(n_times):
        do()
    return (time.perf_counter() - start) / n_times


if __name__ == "__main__":
    main()
