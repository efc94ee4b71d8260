"""Results for people: tables, comparisons and pages, as pure functions of typed summaries."""
