"""Making our model class known to lm-eval, without importing it, and it to our tasks."""

__all__ = ["NAME", "model_takes_references", "register", "say_model_takes_references"]

NAME = "infthor"
_TARGET = "infthor_eval.harness.model:InfthorLM"
_references = False


def register() -> None:
    """Register the class under its name, as a "module:Class" that lm-eval imports when a person asks for it."""
    import lm_eval.models  # noqa: F401 - before registering, or the built-in models vanish (0.4.13)
    from lm_eval.api.registry import model_registry

    if NAME not in model_registry:
        model_registry.register(NAME, target=_TARGET)


def say_model_takes_references() -> None:
    """Our class is the model of this process: lm-eval makes the model first, and has no way to tell a task of it."""
    global _references  # noqa: PLW0603 - lm-eval hands nothing from the model to the tasks
    _references = True


def model_takes_references() -> bool:
    """Whether requests need no pixels. A decoded frame takes 270 KB in every request that shows it."""
    return _references
