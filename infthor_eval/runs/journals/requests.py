"""Requests as a journal keeps them: their texts, and which frames stood where.

Each distinct request is in a journal once, and records name it. So what was sent can be read when
the set that it was made of is gone; the pictures themselves are in that set alone.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby

import msgspec

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from infthor_eval.quantities import Count
from infthor_eval.storage.digests import digest

Stretch = tuple[Count, Count]  # first and last place in the trajectory of neighbouring frames
Places = Callable[[Sequence[FrameRef]], Sequence[int]]


class StoredFrames(msgspec.Struct, frozen=True, omit_defaults=True):
    """Frames that follow each other in a request.

    Attributes:
        n: number of frames.
        places: where in the trajectory they are, in the order shown; empty where they are no frames
            of it.
        what: what they are, in words ("blank frames", "video of 1 frames per second").
    """

    n: Count
    places: tuple[Stretch, ...] = ()
    what: str = "frames"


class StoredRequest(
    msgspec.Struct, frozen=True, omit_defaults=True, tag_field="type", tag="request"
):
    """A request as it was sent.

    Attributes:
        parts: texts and frames in their order; None stands for the question, which is in the
            record.
        shown: where in the trajectory the frames are that it shows, in time order; those that stand
            for others have the places of these.
        after: name of the request that it continues, whose parts come before its own; empty if it
            begins anew. So an agent's growing history is stored once.
        pixels: hash of the digests of all frames in `parts`, in their order; empty without frames.
    """

    parts: tuple[str | StoredFrames | None, ...] = ()
    shown: tuple[Stretch, ...] = ()
    after: str = ""
    pixels: str = ""

    @classmethod
    def of(
        cls,
        context: Sequence[str | FrameRef | Video],
        text: str = "",
        question: str = "",
        places_of: Places = lambda _: (),
        what: str = "frames",
        shown: Sequence[int] = (),
        after: str = "",
    ) -> "StoredRequest":
        """Return a request as it is stored.

        Args:
            context: texts, frames and films before the text.
            text: the text, with the question in it.
            question: the question, as its record has it; empty for none.
            places_of: returns the places of frames in their trajectory; none if they are no frames
                of it.
            what: what the frames are, in words.
            shown: places of all shown frames, in any order.
            after: see `StoredRequest`.

        Raises:
            DataError: a frame cannot be read.
        """
        asked: tuple[str | None, ...] = (text,)
        if question and question in text:
            begin, _, end = text.rpartition(question)
            asked = (begin, None, end)
        parts = (*_parts(context, places_of, what), *asked)
        joined = _joined([part for part in parts if part != ""])
        frames = [frame for part in context for frame in _frames_in(part)]
        pixels = digest("".join(frame.digest for frame in frames), 8) if frames else ""
        return cls(tuple(joined), stretches(sorted(set(shown))), after, pixels)

    @property
    def fingerprint(self) -> str:
        """The name that records have for it."""
        return digest(msgspec.json.encode(self), 8)

    def text(self, question: str, words: Callable[[StoredFrames], str]) -> str:
        """Return it as one text.

        Args:
            question: the record's question.
            words: returns what stands for frames.
        """
        return "".join(
            question if part is None else part if isinstance(part, str) else words(part)
            for part in self.parts
        )


def stretches(places: Sequence[int]) -> tuple[Stretch, ...]:
    """Return first and last of each stretch of ascending neighbours."""
    found: list[Stretch] = []
    for place in places:
        if found and place == found[-1][1] + 1:
            found[-1] = found[-1][0], place
        else:
            found.append((place, place))
    return tuple(found)


def _parts(
    context: Sequence[str | FrameRef | Video], places_of: Places, what: str
) -> Iterator[str | StoredFrames]:
    """Yield texts, frames and films; neighbouring frames are one part."""
    for kind, group in groupby(context, type):
        parts = list(group)
        if kind is FrameRef:
            frames = [frame for part in parts for frame in _frames_in(part)]
            yield StoredFrames(len(frames), stretches(places_of(frames)), what)
            continue
        for part in parts:
            if isinstance(part, Video):
                film = what.replace("frames", f"video of {part.fps:g} frames per second", 1)
                yield StoredFrames(len(part.frames), stretches(places_of(part.frames)), film)
            elif isinstance(part, str):
                yield part


def _frames_in(part: str | FrameRef | Video) -> Sequence[FrameRef]:
    if isinstance(part, Video):
        return part.frames
    return (part,) if isinstance(part, FrameRef) else ()


def _joined(
    parts: Sequence[str | StoredFrames | None],
) -> Iterator[str | StoredFrames | None]:
    """Yield parts with neighbouring texts as one."""
    for kind, group in groupby(parts, type):
        same = list(group)
        yield from ["".join(map(str, same))] if kind is str else same
