"""From the parts of a conversation to what the model is fed.

The checkpoint's own chat template is rendered over the whole conversation and the result is tokenised as a whole, with
one placeholder per frame; placeholders are expanded afterwards, id by id. So merges over the joints of parts come out
as the checkpoint means them, and the cost per reply is that of a short text even where frames take 100,000 tokens.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from PIL import Image, UnidentifiedImageError

from infthor_eval.errors import DataError, ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.hf.family import Family, Size
from model_adapters.protocols import Part

__all__ = ["Frame", "Prompter", "Piece", "begins", "n_common", "n_tokens", "render", "token_ids"]


@dataclass(frozen=True)
class Frame:
    """A frame as a piece of a prompt; two are equal when the files' contents are.

    Attributes:
        digest: hash of the file's content.
        size: width and height in pixels.
        ids: what it expands to.
        ref: where its pixels are.
    """

    digest: str
    size: Size = field(compare=False)
    ids: tuple[int, ...] = field(compare=False)
    ref: FrameRef = field(compare=False)


Piece = int | Frame  # what is encoded, compared and cut as a whole: a token of text, or a frame with all its tokens


def n_tokens(pieces: Sequence[Piece]) -> int:
    """Tokens of a prompt, frames expanded."""
    return sum(1 if isinstance(piece, int) else len(piece.ids) for piece in pieces)


def n_common(prompts: Sequence[Sequence[Piece]]) -> int:
    """Units that all prompts begin with; at least one piece of each is left over."""
    first = min(prompts, key=len)
    for at, piece in enumerate(first[:-1]):
        if any(prompt[at] is not piece and prompt[at] != piece for prompt in prompts):
            return at
    return len(first) - 1


def token_ids(pieces: Iterable[Piece]) -> Iterator[int]:
    """All ids of a prompt, frames expanded."""
    for piece in pieces:
        if isinstance(piece, int):
            yield piece
        else:
            yield from piece.ids


def render(tokenizer: Any, template: str, parts: Sequence[Part], image_token: str) -> str:
    """The chat template over one user turn of these parts, asking for the reply.

    Some templates (LLaVA's) write all images before all texts. Where that would take frames out of the places between
    texts, the turn is given to them as one text with the image's token in it.

    Args:
        tokenizer: the checkpoint's.
        template: its chat template (Jinja).
        parts: the turn.
        image_token: what the template writes for an image.

    Raises:
        ModelError: the template leaves a text out.
    """
    text = _rendered(tokenizer, template, parts)
    for part in parts:
        if isinstance(part, str) and part.strip() not in text:
            raise ModelError(f"the chat template leaves out the text {part.strip()[:40]!r}; it cannot be used")
    n_frames = sum(isinstance(part, FrameRef) for part in parts)
    if text.count(image_token) != n_frames or _keeps_order(text, parts, image_token):
        return text
    inline = "".join(part if isinstance(part, str) else image_token for part in parts)
    return _rendered(tokenizer, template, [inline])


def _rendered(tokenizer: Any, template: str, parts: Sequence[Part]) -> str:
    # Most templates read a text under "text", a few under "content".
    content = [
        {"type": "text", "text": part, "content": part} if isinstance(part, str) else {"type": "image"}
        for part in parts
    ]
    text: str = tokenizer.apply_chat_template(
        [{"role": "user", "content": content}],
        chat_template=template,
        tokenize=False,
        add_generation_prompt=True,
    )
    return text


def _keeps_order(text: str, parts: Sequence[Part], image_token: str) -> bool:
    """Whether the parts stand in a rendered text one after the other."""
    at = 0
    for part in parts:
        written = part.strip() if isinstance(part, str) else image_token
        at = text.find(written, at)
        if at < 0:
            return False
        at += len(written)
    return True


def begins(tokenizer: Any, text: str) -> bool:
    """Whether the template wrote the token that begins every text; where not, processors let the tokenizer add it."""
    return tokenizer.bos_token is not None and text.startswith(tokenizer.bos_token)


class Prompter:
    """Renders and tokenises conversations for one model.

    Args:
        tokenizer: the checkpoint's tokenizer.
        template: the checkpoint's chat template (Jinja).
        family: how frames are expanded.
    """

    def __init__(self, tokenizer: Any, template: str, family: Family) -> None:
        self._tokenizer = tokenizer
        self._template = template
        self._family = family
        self._image_token: str = tokenizer.convert_ids_to_tokens(family.placeholder_id)
        self._frames: dict[str, Frame] = {}
        self._ids: dict[Size, tuple[int, ...]] = {}

    def pieces(self, parts: Sequence[Part]) -> list[Piece]:
        """The prompt that asks for the reply to one user turn of these parts.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the tokenised template does not hold one placeholder per frame.
        """
        frames = [self._frame(part) for part in parts if isinstance(part, FrameRef)]
        text = render(self._tokenizer, self._template, parts, self._image_token)
        ids: list[int] = self._tokenizer(text, add_special_tokens=not begins(self._tokenizer, text))["input_ids"]
        placeholder = self._family.placeholder_id
        if ids.count(placeholder) != len(frames):
            raise ModelError(
                f"the chat template gives {ids.count(placeholder)} image placeholders for {len(frames)} frames; a text "
                "must not contain the model's image token, and the template must show every frame by it "
                f"({self._image_token})"
            )
        rest = iter(frames)
        return [next(rest) if token == placeholder else token for token in ids]

    def _frame(self, ref: FrameRef) -> Frame:
        frame = self._frames.get(ref.digest)
        if frame is None:
            size = _size(ref)
            if size not in self._ids:
                self._ids[size] = self._family.frame_ids(size)
            frame = self._frames[ref.digest] = Frame(ref.digest, size, self._ids[size], ref)
        return frame


def _size(ref: FrameRef) -> Size:
    """Width and height from the file's header; the pixels are decoded only when the frame is encoded."""
    try:
        with Image.open(ref.path) as image:
            return image.size
    except (UnidentifiedImageError, OSError, SyntaxError) as error:
        raise DataError(f"{ref.path}: not a readable image ({error}); restore the frame") from error
