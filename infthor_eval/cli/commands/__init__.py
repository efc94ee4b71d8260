"""The commands, a module each or one of related ones, imported when the command is called."""
