"""Results for people: tables on the terminal, comparisons, pages; pure functions of typed
summaries."""
