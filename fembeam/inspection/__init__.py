"""What a scene is before it is run, contacts to expect, steps and modes to take, and what looks wrong with it.

`check` has the result, `trial` a short run and strikes at the stops, `units` numbers that look like another unit,
`sampling` what looks wrong with duration and steps. Imports: `study` and what it imports. Begin with `check`.
"""

from fembeam.inspection.check import Check, check, doubts
