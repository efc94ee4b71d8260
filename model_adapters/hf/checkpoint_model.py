"""Base of models of a checkpoint, however its weights are run."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

from infthor_eval.formats.frames import FrameRef
from model_adapters.backend import BackendConversation
from model_adapters.hf.limits import wrap_model_errors
from model_adapters.hf.loaded import LoadedCheckpoint
from model_adapters.hf.prompt import Piece, Prompter, n_tokens
from model_adapters.hf.threads import torch_threads
from model_adapters.protocols import Capabilities, Decoding, Reply, Turn

__all__ = ["CheckpointModel"]


class CheckpointModel(ABC):
    """A model whose prompts are written here, by the checkpoint's tokenizer and template.

    Args:
        name: name in the registry.
        loaded: the checkpoint.
        threads: torch threads of its computations; torch's default where None.
    """

    def __init__(self, name: str, loaded: LoadedCheckpoint, threads: int | None = None) -> None:
        self.name = name
        self._loaded = loaded
        self._threads = threads
        self._prompter = Prompter(loaded.tokenizer, loaded.template, loaded.family)

    @property
    @abstractmethod
    def capabilities(self) -> Capabilities:
        """Capabilities of the model."""

    @property
    def loaded(self) -> LoadedCheckpoint:
        """The checkpoint, for training."""
        return self._loaded

    def conversation(self) -> BackendConversation:
        """Return a new, empty conversation."""
        return BackendConversation(self)

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """Return the tokens of one frame, as the checkpoint's processor expands it."""
        with wrap_model_errors(self.name), torch_threads(self._threads):
            return len(self._prompter.frame(frame).ids)

    def pieces(self, turns: Sequence[Turn]) -> list[Piece]:
        """Return the prompt that asks for a reply to these turns."""
        with torch_threads(self._threads):
            return self._prompter.pieces(turns)

    def count(self, turns: Sequence[Turn]) -> int:
        """Return the context size of a reply to these turns, in tokens."""
        with wrap_model_errors(self.name):
            return n_tokens(self.pieces(turns))

    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """Answer a conversation; see `Conversation.reply`."""
        return self.answer_each([turns], decoding)[0]

    @abstractmethod
    def answer_each(self, conversations: Sequence[Sequence[Turn]], decoding: Decoding) -> list[Reply]:
        """Answer several conversations; see `Conversation.replies`."""
