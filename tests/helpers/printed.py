"""What a command prints."""

__all__ = ["read_rows"]


def read_rows(output: str) -> list[str]:
    """The lines of printed tables, with one blank between words."""
    return [" ".join(line.split()) for line in output.splitlines()]
