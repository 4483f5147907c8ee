"""Scene files: TOML in, a scene with its reduction and studies out.

`reader` reads the file, `tables` makes objects of its tables, `keys` checks names against constructors, `kinds` lists
what a `kind` may be, the tables of studies follow; `json_schema` and `template` are made from the same. Imports:
`study`, `results` and the rooms below. Begin with `reader`.
"""

from fembeam.scene_file.json_schema import json_schema
from fembeam.scene_file.reader import SceneFile, built, read
from fembeam.scene_file.tables import SceneFileError
from fembeam.scene_file.template import TEMPLATE

__all__ = ["TEMPLATE", "SceneFile", "SceneFileError", "built", "json_schema", "read"]
