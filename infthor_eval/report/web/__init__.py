"""Runs as one page that works offline: results, and every sample with its frames and replies.

To add a section of the report: `build.py`, or the suite's presenter in
`infthor_eval/report/suites/`; its looks in `report.html`, `report.css` and `report.js`.
"""
