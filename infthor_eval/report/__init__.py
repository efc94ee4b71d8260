"""What people see of results: tables on the terminal, comparisons, pages; pure functions of typed summaries."""
