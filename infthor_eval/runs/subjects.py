"""What a run evaluates: a model, a policy, or one of its suite's baselines."""

from infthor_eval.errors import UsageError
from infthor_eval.runs.request import PreparedRun
from model_adapters import Model, Policy, Subject, load

__all__ = ["subject_of"]


def subject_of(run: PreparedRun) -> Subject:
    """Load it.

    Raises:
        UsageError: the suite needs what it is not.
        ModelError: it cannot be loaded.
    """
    request, suite = run.request, run.suite
    if request.model in suite.baselines:
        return suite.baselines[request.model](request.tasks.seed)
    subject = load(request.model, request.model_options, request.tasks.seed)
    wanted: type = {"conversation": Model, "policy": Policy}[suite.needs]
    if not isinstance(subject, wanted):
        subject.close()
        raise UsageError(f"{request.model} cannot be evaluated on {suite.name}, which needs a {suite.needs}")
    return subject
