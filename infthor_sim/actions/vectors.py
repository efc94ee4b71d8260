"""The type of arguments that are positions or rotations."""

__all__ = ["Vector3"]


class Vector3(dict[str, float]):
    """Annotates arguments that are a position (metres) or rotation (degrees): `{"x", "y", "z"}`,
    any of them absent."""
