"""The base of the baselines of all suites."""

from typing import Any

from model_adapters import Capabilities

__all__ = ["BaselineSubject"]


class BaselineSubject:
    """A subject without options that sees no frame and holds no resource."""

    name = ""
    capabilities = Capabilities(counts_tokens=False, token_ids=False)

    def __init__(self, seed: int) -> None:
        """Take the seed of the run."""
        self._seed = seed

    def identity(self) -> dict[str, Any]:
        """Return the name; what is drawn depends on the seed, which the run's config has anyway."""
        return {"baseline": self.name}

    def close(self) -> None:
        """Nothing is held."""
