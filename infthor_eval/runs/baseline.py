"""What the baselines of all suites have in common."""

from typing import Any

from model_adapters import Capabilities

__all__ = ["BaselineSubject"]


class BaselineSubject:
    """A subject without options that sees no frame and holds nothing open."""

    name = ""
    capabilities = Capabilities(counts_tokens=False, token_ids=False)

    def __init__(self, seed: int) -> None:
        """Make it.

        Args:
            seed: of the run.
        """
        self._seed = seed

    def identity(self) -> dict[str, Any]:
        """The name alone: what is drawn depends on the run's own seed."""
        return {"baseline": self.name}

    def close(self) -> None:
        """Nothing is held."""
