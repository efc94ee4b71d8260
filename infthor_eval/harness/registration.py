"""Registers our model class with lm-eval unimported, and tells our tasks whether it is used."""

from infthor_eval.exports import LM_EVAL_MODEL as NAME

__all__ = ["NAME", "model_takes_references", "register", "say_model_takes_references"]

_TARGET = "infthor_eval.harness.model:InfthorLM"
_references = False


def register() -> None:
    """Register the class as a "module:Class" that lm-eval imports when a person asks for it."""
    import lm_eval.models  # noqa: F401 - before registering, or the built-in models vanish (0.4.13)
    from lm_eval.api.registry import model_registry

    if NAME not in model_registry:
        model_registry.register(NAME, target=_TARGET)


def say_model_takes_references() -> None:
    """Record that our class is this process's model; lm-eval creates the model before the tasks."""
    global _references  # noqa: PLW0603 - lm-eval passes nothing from the model to the tasks
    _references = True


def model_takes_references() -> bool:
    """Return True if requests need no pixels: a decoded frame takes 270 KB in each request."""
    return _references
