"""From the turns of a conversation to the prompt of the model.

The checkpoint's chat template is rendered over the whole conversation, and the result is tokenised as a whole with one
placeholder per frame. Placeholders are expanded afterwards, on token ids. So tokens may span the borders of parts, as
the checkpoint was trained, and tokenising costs as little as a short text even if frames take 100,000 tokens.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.hf.family import Family, Size
from model_adapters.hf.rendering import render, starts_with_bos
from model_adapters.protocols import Turn

__all__ = ["Frame", "Piece", "Prompter", "n_common", "n_tokens", "token_ids"]


@dataclass(frozen=True)
class Frame:
    """A frame as a piece of a prompt; frames with the same file content are equal.

    Attributes:
        digest: hash of the file's content.
        size: width and height in pixels.
        ids: token ids that the frame expands to.
        ref: reference to the pixels.
    """

    digest: str
    size: Size = field(compare=False)
    ids: tuple[int, ...] = field(compare=False)
    ref: FrameRef = field(compare=False)


Piece = int | Frame  # unit of comparing and cutting: a token of text, or a frame with all its tokens


def n_tokens(pieces: Sequence[Piece]) -> int:
    """Return the tokens of a prompt, frames expanded."""
    return sum(1 if isinstance(piece, int) else len(piece.ids) for piece in pieces)


def n_common(prompts: Sequence[Sequence[Piece]]) -> int:
    """Return the number of pieces that all prompts begin with; at least one piece of each is left over."""
    first = min(prompts, key=len)
    for at, piece in enumerate(first[:-1]):
        if any(prompt[at] is not piece and prompt[at] != piece for prompt in prompts):
            return at
    return len(first) - 1


def token_ids(pieces: Iterable[Piece]) -> Iterator[int]:
    """Yield all token ids of a prompt, frames expanded."""
    for piece in pieces:
        if isinstance(piece, int):
            yield piece
        else:
            yield from piece.ids


class Prompter:
    """Renders and tokenises conversations for one model, by a template (Jinja)."""

    def __init__(self, tokenizer: Any, template: str, family: Family) -> None:
        self._tokenizer = tokenizer
        self._template = template
        self._family = family
        self._image_token: str = tokenizer.convert_ids_to_tokens(family.placeholder_id)
        self._frames: dict[str, Frame] = {}
        self._ids: dict[Size, tuple[int, ...]] = {}

    def pieces(self, turns: Sequence[Turn]) -> list[Piece]:
        """Return the prompt that asks for the reply to these turns.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the template refuses the turns, or does not write one placeholder per frame.
        """
        frames = [self.frame(part) for turn in turns for part in turn.parts if isinstance(part, FrameRef)]
        text = render(self._tokenizer, self._template, turns, self._image_token)
        needs_bos = not starts_with_bos(self._tokenizer, text)
        ids: list[int] = self._tokenizer(text, add_special_tokens=needs_bos)["input_ids"]
        placeholder = self._family.placeholder_id
        if ids.count(placeholder) != len(frames):
            raise ModelError(
                f"the chat template gives {ids.count(placeholder)} image placeholders for {len(frames)} frames; a text "
                "must not contain the model's image token, and the template must show every frame by it "
                f"({self._image_token})"
            )
        rest = iter(frames)
        return [next(rest) if token == placeholder else token for token in ids]

    def frame(self, ref: FrameRef) -> Frame:
        """Return a frame as a piece of a prompt.

        Raises:
            DataError: the frame cannot be read.
        """
        frame = self._frames.get(ref.digest)
        if frame is None:
            size = ref.size
            if size not in self._ids:
                self._ids[size] = self._family.frame_ids(size)
            frame = self._frames[ref.digest] = Frame(ref.digest, size, self._ids[size], ref)
        return frame
