"""How far the making of a page is."""


class PageProgress:
    """Observes the making of a page: several pieces of work, each of many parts; tells nobody."""

    def begin(self, what: str, n: int) -> None:
        """Start to count the n parts of a piece of work ("episodes replayed")."""

    def advance(self, what: str, detail: str = "") -> None:
        """Count a part of a piece of work that was begun."""
