"""The command line."""

from fembeam.cli.commands import main

__all__ = ["main"]
