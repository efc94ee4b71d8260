from pathlib import Path

import pytest

from infthor_eval.formats.frames import FrameRef
from infthor_eval.memory import Observation, Query, TrajectoryFacts


@pytest.fixture(scope="session")
def observed():
    """Lets a memory observe steps without a file behind their frames; returns what asks it."""

    def observe(
        memory, n_past, tokens_per_frame=10, logs=(), steps=(), write=None, name="t", seed=0
    ):
        facts = TrajectoryFacts(
            name=name, tokens_per_frame=tokens_per_frame, seed=seed, write=write
        )
        observations = [
            Observation(
                number=number,
                frame=FrameRef(Path(f"{name}/{number}.png")),
                action=f"Action{number}" if number else None,
                goal="Wash a mug" if number < 3 else "Cook an egg",
                log=logs[number] if logs else None,
                step=steps[number] if steps else None,
            )
            for number in range(n_past + 1)
        ]
        memory.begin(facts)
        for step in observations[:-1]:
            memory.observe(step)

        def ask(text="Where is it?", budget=None, clues=None):
            return memory.recall(Query(text=text, present=observations[-1], clues=clues), budget)

        return ask

    return observe
