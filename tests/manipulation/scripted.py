"""A policy that does what it is told, for what no real one does on demand."""

from collections.abc import Callable
from typing import Any

from infthor_eval.formats.frames import FrameRef
from model_adapters import ArmDelta, ArmObservation, Capabilities, Episode


class ScriptedPolicy:
    """Gives what a function makes of what it sees and is told; keeps what that was.

    Attributes:
        seen: bytes of the frames.
        told: instructions.
        resets: how often an episode began, by the number of acts before it.
    """

    name = "scripted-policy"
    capabilities = Capabilities(counts_tokens=False, token_ids=False)

    def __init__(self, gives: Callable[[int], Any]) -> None:
        self._gives = gives
        self.seen: list[bytes] = []
        self.instructions: list[str] = []
        self.resets: list[int] = []

    def identity(self) -> dict[str, Any]:
        return {"name": self.name}

    def reset(self) -> None:
        self.resets.append(len(self.instructions))

    def act(self, frame: FrameRef, instruction: str) -> Any:
        self.seen.append(frame.path.read_bytes())
        self.instructions.append(instruction)
        return self._gives(len(self.instructions) - 1 - self.resets[-1])

    def close(self) -> None:
        """Nothing is held."""


class EpisodesPolicy:
    """Has its hand move ahead and up, and turn; keeps what it is told.

    Attributes:
        episodes: episodes, each with its observations and how it ended.
        pixels: digests of the views, and of those from the wrist.
    """

    name = "episodes-policy"
    capabilities = Capabilities(counts_tokens=False, token_ids=False)

    def __init__(self) -> None:
        self.episodes: list[tuple[Episode, list[ArmObservation], list[bool]]] = []
        self.pixels: list[tuple[str, str | None]] = []

    def identity(self) -> dict[str, Any]:
        return {}

    def begin(self, episode: Episode) -> None:
        self.episodes.append((episode, [], []))

    def act(self, seen: ArmObservation) -> tuple[ArmDelta, ...]:
        self.episodes[-1][1].append(seen)
        self.pixels.append((seen.image.digest, seen.wrist and seen.wrist.digest))
        return (ArmDelta((0.02, 0.01, 0.03), (0.0, 0.1, 0.2), 1.0),)

    def end(self, *, success: bool) -> None:
        self.episodes[-1][2].append(success)

    def close(self) -> None:
        """Nothing is held."""
