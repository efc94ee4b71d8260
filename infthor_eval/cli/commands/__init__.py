"""The commands, one module each, imported when the command is called:
`infthor_eval.cli.commands.NAME.command`."""
