"""Pictures of replayed episodes, for recordings and for the page.

To add or change what `watch` shows: `replay` of the suite's presenter, its drawing here.
"""
