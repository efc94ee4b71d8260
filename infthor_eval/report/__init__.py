"""What people see of results: tables on the terminal, comparisons, pages."""

from infthor_eval.report.comparison import Comparison, compare, comparison_table
from infthor_eval.report.inspection import write_inspection_page
from infthor_eval.report.terminal import print_table, table_console

__all__ = ["Comparison", "compare", "comparison_table", "print_table", "table_console", "write_inspection_page"]
