"""Tables and files made from journals."""

from infthor_eval.report.nieh_results import accuracies, published_table4, summarise
from infthor_eval.report.tables import nieh_table

__all__ = ["accuracies", "nieh_table", "published_table4", "summarise"]
