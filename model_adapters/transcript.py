"""Turns and marks of a conversation, shared by all back ends."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

from model_adapters.protocols import ROLES, Conversation, Decoding, Mark, Part, Reply, Role, Turn


class Transcript:
    """An append-only list of turns with marks to rewind to.

    Adapters inherit from it and add `reply` and `n_tokens`. An adapter that answers several
    continuations faster than one by one overrides `replies`.
    """

    def __init__(self) -> None:
        self._spoken: list[tuple[Role, Part]] = []
        self._marks: list[Mark] = []

    @property
    def turns(self) -> tuple[Turn, ...]:
        """All turns; adjacent texts are joined, and empty texts and turns are dropped."""
        return self.turns_with(())

    def turns_with(self, continuation: Sequence[Part]) -> tuple[Turn, ...]:
        """Return the turns as if the user had appended these parts, which changes nothing.

        Raises:
            TypeError: a part is neither text, frame reference nor video.
        """
        spoken = [
            part for part in (*self._spoken, *_spoken_parts(continuation, "user")) if part[1] != ""
        ]
        turns = []
        for role, run in groupby(spoken, lambda part: part[0]):
            turns.append(Turn(role, tuple(_join_texts(part for _, part in run))))
        return tuple(turns)

    def append(self, *parts: Part, role: Role = "user") -> None:
        """Add parts at the end: all of them, or none if one is invalid.

        Raises:
            TypeError: a part is neither text, frame reference nor video.
            ValueError: the role is unknown.
        """
        self._spoken.extend(_spoken_parts(parts, role))

    def mark(self) -> Mark:
        """Return a mark at the current end of the conversation."""
        mark = Mark(len(self._spoken))
        self._marks.append(mark)
        return mark

    def rewind(self, mark: Mark) -> None:
        """Drop everything that was appended after the mark, and the marks set after it.

        Raises:
            ValueError: the mark belongs to another conversation, or to a part that was dropped by a
                rewind.
        """
        if mark not in self._marks:
            raise ValueError(
                "the mark belongs to another conversation or to a part that was rewound"
            )
        del self._spoken[mark.n_parts :]
        del self._marks[self._marks.index(mark) + 1 :]

    def replies(
        self: Conversation, continuations: Sequence[Sequence[Part]], decoding: Decoding
    ) -> list[Reply]:
        """Append, reply and rewind, continuation by continuation; see `Conversation.replies`."""
        here = self.mark()
        replies = []
        for parts in continuations:
            try:
                self.append(*parts)
                replies.append(self.reply(decoding))
            finally:
                self.rewind(here)
        return replies


def _spoken_parts(parts: Sequence[Part], role: Role) -> list[tuple[Role, Part]]:
    if role not in ROLES:
        raise ValueError(f"there is no role {role!r}; roles: {', '.join(ROLES)}")
    for part in parts:
        if not isinstance(part, Part):
            raise TypeError(f"a part is a str, a FrameRef or a Video, not {type(part).__name__}")
    return [(role, part) for part in parts]


def _join_texts(parts: Iterable[Part]) -> Iterator[Part]:
    """Yield the parts, with adjacent texts joined."""
    for is_text, run in groupby(parts, lambda part: isinstance(part, str)):
        if is_text:
            yield "".join(map(str, run))
        else:
            yield from run
