"""The parts of a conversation and its marks: what every back end's conversation keeps."""

from infthor_eval.formats.frames import FrameRef
from model_adapters.protocols import Mark, Part

__all__ = ["Transcript"]


class Transcript:
    """An append-only list of parts with marks to rewind to.

    Adapters inherit from it and add `reply` and `n_tokens`.
    """

    def __init__(self) -> None:
        self._parts: list[Part] = []
        self._marks: list[Mark] = []

    @property
    def parts(self) -> tuple[Part, ...]:
        """All parts, texts that touch joined to one, empty texts left out."""
        joined: list[Part] = []
        for part in self._parts:
            if isinstance(part, str) and joined and isinstance(joined[-1], str):
                joined[-1] += part
            elif part:
                joined.append(part)
        return tuple(joined)

    def append(self, *parts: Part) -> None:
        """Add parts at the end; all or, where one of them is no part, none.

        Raises:
            TypeError: a part is neither text nor a frame reference.
        """
        for part in parts:
            if not isinstance(part, str | FrameRef):
                raise TypeError(f"a part is a str or a FrameRef, not {type(part).__name__}")
        self._parts.extend(parts)

    def mark(self) -> Mark:
        """The present end, to come back to."""
        mark = Mark(len(self._parts))
        self._marks.append(mark)
        return mark

    def rewind(self, mark: Mark) -> None:
        """Forget all that was appended after the mark, and the marks set after it.

        Raises:
            ValueError: the mark is another conversation's, or lies after a point that was rewound to.
        """
        if mark not in self._marks:
            raise ValueError("the mark belongs to another conversation or to a part that was rewound")
        del self._parts[mark.n_parts :]
        del self._marks[self._marks.index(mark) + 1 :]
