"""Contract checks that anyone can run on their own adapter.

They ask for behaviour through the protocols only, so they hold for every back end; each violated clause raises an
error of one line.
"""

from model_adapters.check.clauses import ContractError
from model_adapters.check.model import check_adapter
from model_adapters.check.policy import check_policy
from model_adapters.check.results import CheckResult, run_checks

__all__ = ["CheckResult", "ContractError", "check_adapter", "check_policy", "run_checks"]
