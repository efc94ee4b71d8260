"""The commands, a module each or one of related ones, imported when the command is called.

To add a command: a module here, or in the folder of its group, with an example, and its line in a
group of `infthor_eval/cli/main.py`; there too, in `_SHARED_MODULES`, if it shares a module.
"""
