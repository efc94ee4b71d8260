"""Charts of the page as SVG elements: in its colours, and readable at the width of a phone.

matplotlib draws the figures of the paper (`report.figures`). A page has many charts, and an index
of runs has hundreds: these take a millisecond each, and their letters keep their size.
"""
