"""Output of commands: console, tables, files and progress."""
