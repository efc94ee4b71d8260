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

_FRAMES = "frames"

Stretch = tuple[Count, Count]  # first and last place in the trajectory of neighbouring frames
Places = Callable[[Sequence[FrameRef]], Sequence[int]]


class StoredFrames(msgspec.Struct, frozen=True, omit_defaults=True):
    """Frames that follow each other in a request.

    Attributes:
        places: where in the trajectory they are, in the order shown; empty where they are no frames
            of it.
        others: number of frames that are none of the trajectory.
        what: what they are, in words ("frames (blank)", "video of 1 frames per second").
    """

    places: tuple[Stretch, ...] = ()
    others: Count = 0
    what: str = _FRAMES

    @property
    def n(self) -> int:
        """Number of frames."""
        return self.others + sum(last - first + 1 for first, last in self.places)

    @property
    def in_words(self) -> str:
        """Places of the frames, or their number, in square brackets: "[frames: 3, 5 to 9]"."""
        places = ", ".join(
            str(first) if first == last else f"{first} to {last}" for first, last in self.places
        )
        return f"[{self.what}: {places}]" if places else f"[{self.n} {self.what}]"


class StoredRequest(
    msgspec.Struct, frozen=True, omit_defaults=True, tag_field="type", tag="request"
):
    """A request as it was sent.

    Attributes:
        stored: texts and frames in their order; None stands for the question, which is in the
            record, and a number for one frame at that place, as an agent's history has after each
            step.
        shown: where in the trajectory the frames are that it shows, in time order; those that stand
            for others have the places of these.
        after: name of the request that it continues, whose parts come before its own; empty if it
            begins anew. So an agent's growing history is stored once.
        pixels: hash of the digests of all frames in `parts`, in their order; empty without frames.
    """

    stored: tuple[str | Count | StoredFrames | None, ...] = ()
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
        what: str = _FRAMES,
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
        parts: list[str | int | StoredFrames | None] = []
        digests: list[str] = []
        for described, same in _in_sequence(context, what):
            if isinstance(same, str):
                parts.append(same)
                continue
            places = places_of(same)
            others = len(same) - len(places)
            alone = described == _FRAMES and len(same) == len(places) == 1
            stored = StoredFrames(stretches(places), others, described)
            parts.append(places[0] if alone else stored)
            digests += [frame.digest for frame in same]
        joined = _joined([part for part in (*parts, *asked) if part != ""])
        pixels = digest("".join(digests), 8) if digests else ""
        return cls(tuple(joined), stretches(sorted(set(shown))), after, pixels)

    @property
    def parts(self) -> Iterator[str | StoredFrames | None]:
        """Texts and frames in their order; None stands for the question."""
        for part in self.stored:
            yield StoredFrames(((part, part),)) if isinstance(part, int) else part

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
    begins = [at for at, place in enumerate(places) if not at or place != places[at - 1] + 1]
    ends = [*begins[1:], len(places)]
    return tuple((places[at], places[end - 1]) for at, end in zip(begins, ends, strict=False))


def _in_sequence(
    context: Sequence[str | FrameRef | Video], what: str
) -> Iterator[tuple[str, str | Sequence[FrameRef]]]:
    """Yield texts, and frames with what they are; neighbouring frames are together."""
    for kind, group in groupby(context, type):
        if kind is FrameRef:
            yield what, [part for part in group if isinstance(part, FrameRef)]
            continue
        for part in group:
            if isinstance(part, Video):
                film = f"video of {part.fps:g} frames per second"
                yield what.replace(_FRAMES, film, 1), part.frames
            elif isinstance(part, str):
                yield "", part


def _joined(
    parts: Sequence[str | int | StoredFrames | None],
) -> Iterator[str | int | StoredFrames | None]:
    """Yield parts with neighbouring texts as one."""
    for kind, group in groupby(parts, type):
        same = list(group)
        yield from ["".join(map(str, same))] if kind is str else same
