"""From the turns of a conversation to the prompt of the model.

The checkpoint's chat template is rendered over the whole conversation, and the result is tokenised
as a whole with one placeholder per frame or video. Placeholders are expanded afterwards, on token
ids. So tokens may span the borders of parts, as the checkpoint was trained, and tokenising costs as
little as a short text even if frames take 100,000 tokens.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from infthor_eval.errors import DataError, ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from model_adapters.hf.family import NO_TOKEN, ClipShape, Family, Size, VideoInput
from model_adapters.hf.prompting.rendering import Marks, render, starts_with_bos, writes_videos
from model_adapters.protocols import Turn


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

    @property
    def shape(self) -> Size:
        """All that the positions of its tokens depend on."""
        return self.size


@dataclass(frozen=True)
class Clip:
    """Successive frames of a video as a piece of a prompt.

    Attributes:
        digests: hashes of the files' contents.
        shape: the clip's size, and its place in the video.
        ids: token ids that the clip expands to.
        refs: references to the pixels.
    """

    digests: tuple[str, ...]
    shape: ClipShape
    ids: tuple[int, ...] = field(compare=False)
    refs: tuple[FrameRef, ...] = field(compare=False)


# Unit of comparing and cutting: a token of text, or a frame or a clip with all its tokens.
Piece = int | Frame | Clip


def width(piece: Piece) -> int:
    """Return the tokens of a piece."""
    return 1 if isinstance(piece, int) else len(piece.ids)


def n_tokens(pieces: Sequence[Piece]) -> int:
    """Return the tokens of a prompt, frames and clips expanded."""
    return sum(map(width, pieces))


def n_common(prompts: Sequence[Sequence[Piece]]) -> int:
    """Return how many pieces all prompts begin with; at least one piece of each is left over."""
    first = min(prompts, key=len)
    for at, piece in enumerate(first[:-1]):
        if any(prompt[at] is not piece and prompt[at] != piece for prompt in prompts):
            return at
    return len(first) - 1


def n_nested(prompts: Sequence[Sequence[Piece]]) -> list[int]:
    """Return how many pieces of each prompt begin the one with the most frames, where those are all
    of its frames; nothing where one has others."""
    ends = list(map(end_of_frames, prompts))
    longest = max(ends)
    whole = [prompt for prompt, end in zip(prompts, ends, strict=True) if end == longest]
    common = n_common(whole)
    shared = [
        common if end == longest else n_common([prompt, whole[0]])
        for prompt, end in zip(prompts, ends, strict=True)
    ]
    return shared if all(n >= end for n, end in zip(shared, ends, strict=True)) else []


def end_of_frames(prompt: Sequence[Piece]) -> int:
    """Return how many pieces a prompt has up to its last frame."""
    ends = (at for at, piece in enumerate(prompt, 1) if not isinstance(piece, int))
    return max(ends, default=0)


def token_ids(pieces: Iterable[Piece]) -> Iterator[int]:
    """Yield all token ids of a prompt, frames and clips expanded."""
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
        text_of = tokenizer.convert_ids_to_tokens
        video = None if family.video is None else text_of(family.video.placeholder_id)
        image = text_of(family.placeholder_id) if self.takes_frames else None
        self._marks = Marks(image, video)
        self._frames: dict[str, Frame] = {}
        self._ids: dict[Size, tuple[int, ...]] = {}

    @property
    def takes_frames(self) -> bool:
        """True if the family takes frames."""
        return self._family.placeholder_id != NO_TOKEN

    @cached_property
    def takes_videos(self) -> bool:
        """True if the family has a video input and the template writes its placeholder."""
        return writes_videos(self._tokenizer, self._template, self._marks)

    def pieces(self, turns: Sequence[Turn]) -> list[Piece]:
        """Return the prompt that asks for the reply to these turns."""
        parts = [part for turn in turns for part in turn.parts]
        text = render(self._tokenizer, self._template, turns, self._marks)
        needs_bos = not starts_with_bos(self._tokenizer, text)
        ids: list[int] = self._tokenizer(text, add_special_tokens=needs_bos)["input_ids"]
        expanded: dict[int, Iterator[Sequence[Piece]]] = {}
        frames = [[self.frame(part)] for part in parts if isinstance(part, FrameRef)]
        self._check_placeholders(ids, self._family.placeholder_id, len(frames), "image", "frame")
        expanded[self._family.placeholder_id] = iter(frames)
        video = self._family.video
        if video is not None:
            videos = [self._clips(part, video) for part in parts if isinstance(part, Video)]
            self._check_placeholders(ids, video.placeholder_id, len(videos), "video", "video")
            expanded[video.placeholder_id] = iter(videos)
        return [
            piece
            for token in ids
            for piece in (next(expanded[token]) if token in expanded else (token,))
        ]

    def frame(self, ref: FrameRef) -> Frame:
        """Return a frame as a piece of a prompt."""
        frame = self._frames.get(ref.digest)
        if frame is None:
            size = ref.size
            if size not in self._ids:
                self._ids[size] = self._family.frame_ids(size)
            frame = self._frames[ref.digest] = Frame(ref.digest, size, self._ids[size], ref)
        elif frame.ref != ref:
            # Twins have the same pictures in folders of their own, and the earlier one may be gone.
            frame = self._frames[ref.digest] = replace(frame, ref=ref)
        return frame

    def _clips(self, video: Video, converter: VideoInput) -> list[Clip]:
        """Return a video as pieces of a prompt."""
        per_clip = converter.clip_frames
        refs = video.frames
        size = refs[0].size
        other = next((ref for ref in refs if ref.size != size), None)
        if other is not None:
            raise DataError(
                f"{other.path}: has another size than the video's first frame; give frames of one "
                "size"
            )
        refs = (*refs, *refs[-1:] * (-len(refs) % per_clip))
        groups = [refs[at : at + per_clip] for at in range(0, len(refs), per_clip)]
        clips = []
        for number, group in enumerate(groups):
            shape = ClipShape(size, number, len(groups), per_clip / video.fps)
            ids = (converter.placeholder_id,) * converter.n_tokens(shape)
            clips.append(Clip(tuple(ref.digest for ref in group), shape, ids, group))
        return clips

    def _check_placeholders(
        self, ids: Sequence[int], placeholder: int, n: int, kind: str, part: str
    ) -> None:
        if ids.count(placeholder) != n:
            token = self._tokenizer.convert_ids_to_tokens(placeholder)
            raise ModelError(
                f"the chat template gives {ids.count(placeholder)} {kind} placeholders for {n} "
                f"{part}s; a text must not contain the model's {kind} token, and the template must "
                f"show every {part} by it ({token})"
            )
