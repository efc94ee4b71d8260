"""The checks of a submission: a class each, behind one protocol (`infthor_eval.submissions.case`)."""
