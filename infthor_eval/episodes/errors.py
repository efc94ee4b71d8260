"""Errors of episodes."""

from infthor_eval.errors import DataError

__all__ = ["InfeasibleError"]


class InfeasibleError(DataError):
    """Nobody can succeed in an episode in this simulator, so it is excluded for every subject."""
