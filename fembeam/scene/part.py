"""What all parts of a scene have in common: a place on a beam, and a name, given or made."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from fembeam.support import require, require_place


@dataclass(frozen=True, repr=False)
class ScenePart:
    """What stands at z (m) of a beam. `name`: what logs, tables, figures and messages call it.

    ValueError for a z that is no finite number, a name that is no text of one line or empty.
    """

    z: float
    name: str | None = field(default=None, kw_only=True)
    word = "part"  # that a made name begins with

    def __post_init__(self) -> None:
        require_place(self.z, self)
        name: object = self.name
        text = isinstance(name, str) and bool(name.strip()) and name.isprintable()
        where = f"{type(self).__name__} at z = {self.z}"
        require(name is None or text, "name must be text of one line, not empty", name, where,
                "give one such as 'valve', or leave it out")  # fmt: skip

    def __repr__(self) -> str:
        shown = [f.name for f in fields(self) if f.name != "name"] + ["name"] * (self.name is not None)
        return f"{type(self).__name__}({', '.join(f'{name}={getattr(self, name)!r}' for name in shown)})"

    @property
    def where(self) -> str:
        """For messages: "Stop at z = 0.2", "Stop 'valve' at z = 0.2"."""
        return f"{self.titled} at z = {self.z}"

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
        """Its name, else a made one, such as "clamp at 0 m" or "stop at 3 m, below"."""
        return self.label_on(0)

    def label_on(self, body: int) -> str:
        """The same of a part of a further beam: "stop at 3 m of beam 1, below"."""
        at = f"{self.z:.6g} m" + (f" of beam {body}" if body else "")
        return self._made(at) if self.name is None else self.name

    def _made(self, at: str) -> str:
        """A name that says what it is and where."""
        return f"{self.word} at {at}"
