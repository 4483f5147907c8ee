"""The command line: `fembeam new`, `check`, `draw`, `modes`, `run`, `compare`, `export`, `schema`, `completion`.

`commands` has the parser and a short function per command; `run` computes a scene file and writes its results folder;
`messages` prints errors and warnings in one line. Imports: `scene_file`, `results`, `inspection` and what they import,
inside functions, so that help is quick and Ctrl-C is handled from the start. Begin with `commands`.
"""

from fembeam.cli.commands import main

__all__ = ["main"]
