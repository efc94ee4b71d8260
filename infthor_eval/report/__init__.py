"""Tables and files made from journals."""

from infthor_eval.report.comparison import Comparison, compare
from infthor_eval.report.inspection import write_inspection_page
from infthor_eval.report.nieh_results import accuracies, published_table4, summarise
from infthor_eval.report.tables import answers_table, comparison_table, depth_table, nieh_table

__all__ = [
    "Comparison",
    "accuracies",
    "answers_table",
    "compare",
    "comparison_table",
    "depth_table",
    "nieh_table",
    "published_table4",
    "summarise",
    "write_inspection_page",
]
