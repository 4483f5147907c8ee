"""Scene files: TOML in, a scene with its reduction and studies out.

`reader` reads the file; `tables` checks every key and value and makes the objects; `keys` has the names and types of
the keys, read from the constructors, `kinds` the values of `kind`. `study_tables` are the tables of studies;
`json_schema` is made from the same, `template.toml` shows it. Imports: `study` and what it imports.
Begin with `reader`.
"""

from fembeam.scene_file.json_schema import json_schema
from fembeam.scene_file.reader import SceneFile, built, read, template
from fembeam.scene_file.tables import SceneFileError
