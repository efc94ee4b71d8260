"""The adapter: what infthor-eval asks of a model, kept by a model of a few rules."""

from dataclasses import dataclass
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_thumbnails.rules import answer, thumbnail
from model_adapters import (
    Capabilities,
    Decoding,
    Reply,
    Transcript,
    check_decoding,
    check_turns,
    cut_at_stop,
)

__all__ = ["Options", "Thumbnails"]

# It counts tokens (a colour and a word are one each) and has no ids; what is not named here it
# cannot do.
_CAPABILITIES = Capabilities(token_ids=False)


@dataclass(frozen=True)
class Options:
    """What `--model-args` can say.

    Attributes:
        side: width and height of a thumbnail, in colours.
    """

    side: int = 4


class Thumbnails:
    """The model."""

    Options = Options
    capabilities = _CAPABILITIES

    def __init__(self, name: str, side: int) -> None:
        """Remember what it was given; a model with weights would load them here."""
        self.name = name
        self.side = side

    @classmethod
    def build(cls, name: str, options: Options, seed: int) -> "Thumbnails":
        """Make the model; `seed` is for models that draw their weights."""
        if options.side < 1:
            raise UsageError(f"{name}: side={options.side}: a thumbnail has one colour at least")
        return cls(name, options.side)

    def identity(self) -> dict[str, Any]:
        """All that can change a reply; the package's version and source come with it."""
        return {"side": self.side}

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """A token per colour, whatever the frame."""
        return self.side**2

    def conversation(self) -> "Talk":
        """A new, empty conversation."""
        return Talk(self)

    def close(self) -> None:
        """There is nothing to give back."""


class Talk(Transcript):
    """A conversation; `Transcript` keeps its turns and marks, so that only counting and answering
    are left to do."""

    def __init__(self, model: Thumbnails) -> None:
        super().__init__()
        self._model = model

    @property
    def n_tokens(self) -> int:
        """Colours of all frames and words of all texts, and a token for each turn."""
        parts = [part for turn in self.turns for part in turn.parts]
        n_words = sum(len(part.split()) for part in parts if isinstance(part, str))
        n_frames = sum(isinstance(part, FrameRef) for part in parts)
        return len(self.turns) + n_words + n_frames * self._model.side**2

    def reply(self, decoding: Decoding) -> Reply:
        """Answer the last turn from all frames that were shown."""
        check_decoding(self._model.name, _CAPABILITIES, decoding)  # refuses what was not claimed
        check_turns(self._model.name, _CAPABILITIES, self.turns)  # refuses to speak out of turn
        frames = [part for turn in self.turns for part in turn.parts if isinstance(part, FrameRef)]
        asked = "".join(part for part in self.turns[-1].parts if isinstance(part, str))
        words = answer(
            asked, [thumbnail(frame.load(), self._model.side) for frame in frames]
        ).split()
        text = " ".join(words[: decoding.max_new_tokens])
        cut = cut_at_stop(text, decoding.stop)
        return Reply(
            text=text if cut is None else cut,
            n_reply_tokens=min(len(words), decoding.max_new_tokens),
            n_context_tokens=self.n_tokens,
            n_cached_tokens=0,
        )
