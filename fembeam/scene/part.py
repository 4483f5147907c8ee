"""What all parts of a scene have in common: a place, and a name, given or made.

Annotations are evaluated here: the classes derived from this one stand in files that need not know them.
"""

from dataclasses import dataclass, field, fields
from typing import Any

from fembeam.scene.local_coordinate import LocalCoordinate
from fembeam.scene.places import Place, directed_words, place_words, quoted
from fembeam.structures import Six, direction_of
from fembeam.support import is_whole, make_native, require, require_place

UNSAID = ("direction", "motion", "name", "friction", "tangent", "radius")  # of a part, when they are None


@dataclass(frozen=True, repr=False)
class ScenePart:
    """What stands at a place z. `name`: what logs, tables, figures and messages call it.

    ValueError for a z that is no place, a name that is no text of one line or empty.
    """

    z: Place
    name: str | None = field(default=None, kw_only=True)
    word = "part"  # that a made name begins with

    def __post_init__(self) -> None:
        make_native(self)
        require_place(self.z, self)
        name: object = self.name
        text = isinstance(name, str) and bool(name.strip()) and name.isprintable()
        where = f"{type(self).__name__} at {quoted(self.z)}"
        require(name is None or text, "name must be text of one line, not empty", name, where,
                "give one such as 'valve', or leave it out")  # fmt: skip
        for key in ("direction", "tangent"):
            if isinstance(given := getattr(self, key, None), list):
                object.__setattr__(self, key, tuple(given))

    def __repr__(self) -> str:
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.repr}
        values["name"] = values.pop("name")  # the last one
        shown = (f"{key}={value!r}" for key, value in values.items() if key not in UNSAID or value is not None)
        return f"{type(self).__name__}({', '.join(shown)})"

    @property
    def along(self) -> Six | None:
        """Its direction on the six components; None without one, as on a beam."""
        direction: Any = getattr(self, "direction", None)
        return None if direction is None else direction_of(direction, self.where)

    @property
    def coordinates(self) -> tuple[LocalCoordinate, ...]:
        """All that a stop, an element or a load acts on: the one `coordinate`, unless it has more."""
        part: Any = self
        return (part.coordinate,)

    @property
    def where(self) -> str:
        """For messages: "Stop at z = 0.2", "Stop 'valve' at z = 0.2"."""
        return f"{self.titled} at {quoted(self.z)}"

    @property
    def titled(self) -> str:
        """Its class, with its name if it was given one: "Stop", "Stop 'valve'"."""
        return type(self).__name__ + self.quoted

    @property
    def quoted(self) -> str:
        """For messages, behind what else tells it: " 'valve'"; empty without a name."""
        return "" if self.name is None else f" {self.name!r}"

    @property
    def label(self) -> str:
        """Its name, else a made one, such as "clamp at 0 m", "stop at 3 m, below", "stop at lever, -y"."""
        return self.label_on(0)

    def label_on(self, body: int, named: bool = False) -> str:
        """The same of a part of a further beam: "stop at 3 m of beam 1, below"; ``named``: 3 is a node, not m."""
        if self.name is not None:
            return self.name
        direction: Any = getattr(self, "direction", None)
        place = str(self.z) if named and is_whole(self.z) else place_words(self.z)
        at = place if direction is None else directed_words((self.z, direction))
        return self._made(at + (f" of beam {body}" if body else ""))

    def _made(self, at: str) -> str:
        """A name that says what it is and where."""
        return f"{self.word} at {at}"
