"""The page on a run as it goes.

To add or change the page on a run as it goes: what it shows in `state.py`, its looks in
`live.html`, `live.css` and `live.js`.
"""
