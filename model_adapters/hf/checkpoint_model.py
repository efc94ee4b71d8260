"""Bases of models of a checkpoint."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import torch

from infthor_eval.formats.frames import FrameRef
from model_adapters.backend import BackendConversation
from model_adapters.hf.global_settings import torch_threads
from model_adapters.hf.limits import wrap_model_errors
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.prompt import Piece, Prompter, n_tokens
from model_adapters.options.checkpoints import HfOptions
from model_adapters.protocols import Capabilities, Decoding, Reply, Turn


class CheckpointModel(ABC):
    """A model whose prompts are written here, by the checkpoint's tokenizer and template.

    `threads` are the torch threads of its computations; torch's default where None.
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
    def answer_each(
        self, conversations: Sequence[Sequence[Turn]], decoding: Decoding
    ) -> list[Reply]:
        """Answer several conversations; see `Conversation.replies`."""


class HfModel(CheckpointModel):
    """A model whose weights transformers runs in this process.

    Attributes:
        cuts_caches: True if it answers behind a cache that was cut.
    """

    cuts_caches: ClassVar[bool] = False

    def __init__(self, name: str, loaded: LoadedCheckpoint, options: HfOptions) -> None:
        super().__init__(name, loaded, options.threads)
        self._options = options
        self._chunk_tokens = options.chunk_size(loaded.model.device.type)

    @property
    def capabilities(self) -> Capabilities:
        """Sampling and choices, a request at a time, `_batch_size` continuations together."""
        text_config = self._loaded.model.config.get_text_config()
        return Capabilities(
            sampling=True,
            choices=True,
            image_input=self._prompter.takes_frames,
            video_input=self._prompter.takes_videos,
            cache_cuts=self.cuts_caches and self._options.attention is None,
            batch_size=self._batch_size,
            max_tokens=self._context_limit,
            max_tokens_before_extension=None
            if self._options.rope is None
            else text_config.max_position_embeddings,
        )

    def identity(self) -> dict[str, Any]:
        """Return checkpoint, precision, kernels, versions, generation settings, as JSON values."""
        options = self._options
        generation = self._loaded.generation
        return self._loaded.identity | {
            "adapter": self.name,
            "max_tokens": self._context_limit,
            "prompt": options.prompt,
            "share_prefix": options.share_prefix,
            "chunk_tokens": self._chunk_tokens,
            "batch_size": options.batch_size,
            "generation": {
                "repetition_penalty": generation.repetition_penalty,
                "end_ids": sorted(generation.end_ids),
            },
            **options.attention_identity(),
        }

    def close(self) -> None:
        """Free the weights."""
        del self._loaded, self._prompter
        if torch.cuda.is_available():
            torch.cuda.empty_cache()

    @property
    def _batch_size(self) -> int:
        return 1

    @property
    def _context_limit(self) -> int | None:
        """Context limit of the options, else of the checkpoint, or None."""
        chosen = self._options.max_tokens
        return (self._loaded.max_tokens if chosen is None else chosen) or None
