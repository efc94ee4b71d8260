"""How texts spell object types."""

from infthor_eval.household.wording import compact_name, noun


def spellings(object_type: str) -> tuple[str, ...]:
    """Return the spellings of an object type in questions, answers, actions and plans."""
    return (
        f" {noun(object_type)}",
        compact_name(object_type),
        f" {object_type}",
        f" {compact_name(object_type)}",
    )
