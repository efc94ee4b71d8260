"""Contract checks for anybody's adapter.

The checks use the protocols only, so they apply to every back end. A violated clause raises an
error of one line.

To add or change a rule of adapters' contract: a check here, its line in `contract.py: model_checks`
or `policy_checks` there, and in `docs/own-models.md`.
"""

from model_adapters.check.clauses import ContractError
from model_adapters.check.contract import check_adapter, run_checks
from model_adapters.check.results import CheckResult

__all__ = ["CheckResult", "ContractError", "check_adapter", "run_checks"]
