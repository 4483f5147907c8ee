"""A digest of everything a value or a function consists of, equal between processes.

Of a function: byte code, constants, defaults, closure, and the globals it reads, each followed in the same way; of a
class its methods, of an object its class and state. Code of the standard library and of installed packages counts as
its name and version. Not seen: files, the environment, the clock, and what is found by a name made at run time.
"""

from __future__ import annotations

import dis
import functools
import hashlib
import importlib
import site
import sys
import sysconfig
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from importlib import metadata
from importlib.util import resolve_name
from itertools import takewhile
from pathlib import Path
from types import (
    BuiltinFunctionType,
    CellType,
    CodeType,
    FunctionType,
    GetSetDescriptorType,
    MemberDescriptorType,
    MethodDescriptorType,
    MethodType,
    ModuleType,
    WrapperDescriptorType,
)
from typing import Any

import numpy as np

OURS = {"fembeam", "contacts", "reduction", "solvers"}  # told by fembeam's version
PLAIN = (type(None), bool, int, float, complex, str, bytes, type(Ellipsis), type(NotImplemented))
BY_NAME = (BuiltinFunctionType, np.ufunc, GetSetDescriptorType, MemberDescriptorType, MethodDescriptorType,
           WrapperDescriptorType)  # fmt: skip
GLOBAL_READS = {"LOAD_GLOBAL", "LOAD_NAME", "LOAD_FROM_DICT_OR_GLOBALS"}
ATTRIBUTE_READS = {"LOAD_ATTR", "LOAD_METHOD"}
# of a class: made by Python itself, or of no effect on what is computed
ASIDE = {
    "__dict__", "__weakref__", "__doc__", "__module__", "__firstlineno__", "__annotations__", "__annotate__",
    "__annotate_func__", "__annotations_cache__", "__dataclass_fields__", "__dataclass_params__", "__match_args__",
    "__abstractmethods__", "_abc_impl", "__static_attributes__", "__parameters__", "__orig_bases__",
}  # fmt: skip


def fingerprint(value: Any, name: str = "value") -> str:
    """Digest of a value and all it consists of.

    Parameters
    ----------
    value : data, a function, a class, an object, or any nesting of these.
    name : what messages call it.

    Raises
    ------
    ValueError : something in it cannot be told from another of its kind (an open file, a lock, a generator).

    Examples
    --------
    >>> factor = 2.0
    >>> one, other = (lambda x: factor * x), (lambda x: 3.0 * x)
    >>> fingerprint(one) == fingerprint(one), fingerprint(one) == fingerprint(other)
    (True, False)
    """
    return _Walk().of(value, name)[:16]


class _Walk:
    """One walk through a value: what is under way, so that circles end, and what is done."""

    def __init__(self) -> None:
        self.open: dict[int, int] = {}  # id -> depth
        self.done: dict[int, str] = {}
        self.alive: list[Any] = []  # so that no id is used twice

    def of(self, value: Any, path: str) -> str:
        """Digest of one value; `path` says how it was reached."""
        if isinstance(value, PLAIN) and type(value) in PLAIN:
            return _hash(type(value).__name__, repr(value))
        if id(value) in self.open:
            return _hash("circle", str(self.open[id(value)]))
        if id(value) not in self.done:
            self.open[id(value)] = len(self.open)
            self.alive.append(value)
            self.done[id(value)] = _hash(type(value).__qualname__, *self.parts(value, path))
            del self.open[id(value)]
        return self.done[id(value)]

    def parts(self, value: Any, path: str) -> Iterable[str]:
        """Digests of what a value consists of."""
        if _known(value):
            return [_named(value)]
        if isinstance(value, np.ndarray) and value.dtype.kind != "O":
            return [str(value.dtype), str(value.shape), _hash(np.ascontiguousarray(value).tobytes())]
        if isinstance(value, (list, tuple)) and type(value) in (list, tuple):
            return [self.of(entry, f"{path}[{i}]") for i, entry in enumerate(value)]
        if isinstance(value, (set, frozenset)):
            return sorted(self.of(entry, path) for entry in value)
        if isinstance(value, Mapping) and type(value).__module__ in ("builtins", "types", "collections"):
            return sorted(self.of(k, path) + self.of(v, f"{path}[{k!r}]") for k, v in value.items())
        if isinstance(value, CodeType):
            return self.code(value, path)
        if isinstance(value, ModuleType):
            return self.module(value, path)
        if isinstance(value, type):
            return self.kind(value, path)
        return self.callable(value, path) or self.instance(value, path)

    def callable(self, value: Any, path: str) -> list[str] | None:
        """Parts of functions, methods and what wraps them; None for anything else."""
        if isinstance(value, FunctionType):
            return self.function(value, path)
        if isinstance(value, CellType):
            return self.cell(value, path)
        if isinstance(value, MethodType):
            return [self.of(value.__self__, path), self.of(value.__func__, path)]
        if isinstance(value, functools.partial):
            return [self.of(part, path) for part in (value.func, value.args, value.keywords)]
        if isinstance(value, property):
            return [self.of(part, path) for part in (value.fget, value.fset, value.fdel)]
        for inside in ("py_func", "__wrapped__", "__func__"):  # compiled by numba, cached, static or of a class
            if isinstance(getattr(value, inside, None), FunctionType):
                return [repr(getattr(value, "targetoptions", None)), self.of(getattr(value, inside), path)]
        owner = getattr(value, "__self__", None)
        if isinstance(value, BuiltinFunctionType) and owner is not None and not isinstance(owner, ModuleType):
            return [value.__name__, self.of(owner, path)]
        return [_named(value)] if isinstance(value, BY_NAME) else None

    def cell(self, value: CellType, path: str) -> list[str]:
        """A variable of a closure; one that is not set yet has no contents."""
        try:
            contents = value.cell_contents
        except ValueError:
            return ["empty"]
        return [self.of(contents, path)]

    def function(self, value: FunctionType, path: str) -> list[str]:
        """Parts of a function."""
        own = [value.__defaults__, value.__kwdefaults__, value.__dict__]
        found = [_named(value), self.of(value.__code__, path), *(self.of(part, path) for part in own)]
        reads = [self.read(value, chain, path) for chain in sorted(_reads(value.__code__))]
        return found + self.cells(value, path) + reads

    def cells(self, value: FunctionType, path: str) -> list[str]:
        """The variables of a function's closure."""
        names = value.__code__.co_freevars
        return [self.of(cell, f"{path} → {name}") for name, cell in zip(names, value.__closure__ or (), strict=True)]

    def code(self, value: CodeType, path: str) -> list[str]:
        """Parts of byte code: positions in the file and names of local variables do not count."""
        table = getattr(value, "co_exceptiontable", b"")
        arguments = value.co_varnames[: value.co_argcount + value.co_kwonlyargcount]
        plain = value.co_code, table, repr((value.co_names, arguments, value.co_posonlyargcount, value.co_flags))
        return [*(_hash(part) for part in plain), *(self.of(constant, path) for constant in value.co_consts)]

    def read(self, function: FunctionType, chain: tuple[str, ...], path: str) -> str:
        """What a function reads by a name: its global, or what that module holds."""
        first, *rest = chain
        if first.startswith("import "):
            value = _imported(first.removeprefix("import "), function)
        elif first in function.__globals__:
            value = function.__globals__[first]
        else:
            return _hash("built in", first)
        while rest and isinstance(value, ModuleType) and not installed(value.__name__) and hasattr(value, rest[0]):
            first = rest.pop(0)
            value = getattr(value, first)
        return self.of(value, f"{path} → {first.removeprefix('import ')}")

    def module(self, value: ModuleType, path: str) -> list[str]:
        """Parts of a module that is read as a whole."""
        if installed(value.__name__):
            return [value.__name__, version(value.__name__)]
        own = {name: entry for name, entry in vars(value).items() if not name.startswith("__")}
        return [value.__name__, *(self.of(own[name], f"{path}.{name}") for name in sorted(own))]

    def kind(self, value: type, path: str) -> list[str]:
        """Parts of a class."""
        own = sorted(name for name in vars(value) if name not in ASIDE)
        found = [_named(value), *(self.of(base, path) for base in value.__bases__)]
        return found + [_hash(name, self.of(vars(value)[name], f"{path}.{name}")) for name in own]

    def instance(self, value: Any, path: str) -> list[str]:
        """Parts of an object: its class and its state, as a dataclass or as it would be pickled."""
        kind = self.of(type(value), path)
        if is_dataclass(value):
            kept = [f.name for f in fields(value) if f.compare]
            return [kind, *(_hash(name, self.of(getattr(value, name), f"{path}.{name}")) for name in kept)]
        try:
            how = value.__reduce_ex__(4)
        except Exception as error:
            raise ValueError(
                f"{path} is a {type(value).__module__}.{type(value).__qualname__}, which cannot be told from another "
                f"one ({error}); hand over the numbers it stands for, or leave out checkpoint="
            ) from error
        if isinstance(how, str):  # found again by that name
            return [kind, how]
        state = [list(part) if isinstance(part, Iterator) else part for part in how]
        return [kind, *(self.of(part, path) for part in state)]


def _hash(*parts: str | bytes) -> str:
    """Digest of texts that does not confuse their borders."""
    digest = hashlib.sha256()
    for part in parts:
        raw = part.encode("utf-8", "surrogatepass") if isinstance(part, str) else part
        digest.update(f"{len(raw)}:".encode() + raw)
    return digest.hexdigest()


def _known(value: Any) -> bool:
    """Whether it is a function or class that an installed package has under its name."""
    module, name = getattr(value, "__module__", None), getattr(value, "__qualname__", None)
    if not isinstance(module, str) or not isinstance(name, str) or not installed(module):
        return False
    found: Any = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    return found is value


def _named(value: Any) -> str:
    """Name of a function or class, with the version of an installed package."""
    module = getattr(value, "__module__", None) or ""
    name = getattr(value, "__qualname__", None) or getattr(value, "__name__", type(value).__qualname__)
    return f"{module}.{name} {version(module) if installed(module) else ''}"


def _reads(code: CodeType) -> set[tuple[str, ...]]:
    """Global names that byte code reads, functions in it included, each with the attributes asked of it at once.

    A module imported by the code itself is named "import …".
    """
    steps = list(dis.get_instructions(code))
    found = {_chain(steps[i:]) for i, step in enumerate(steps) if step.opname in GLOBAL_READS}
    for i, step in enumerate(steps):
        if step.opname == "IMPORT_NAME":
            module = f"import {'.' * steps[i - 2].argval}{step.argval}"
            names = steps[i - 1].argval or ()
            found |= {(module, name) for name in names} or {(module,)}
    return found.union(*(_reads(inner) for inner in code.co_consts if isinstance(inner, CodeType)))


def _chain(steps: list[dis.Instruction]) -> tuple[str, ...]:
    """The name read first and the attributes that follow."""
    rest = takewhile(lambda step: step.opname in ATTRIBUTE_READS, steps[1:])
    return (str(steps[0].argval), *(str(step.argval) for step in rest))


def _imported(name: str, function: FunctionType) -> Any:
    """The module a function imports when it runs; None when there is none."""
    try:
        package = function.__globals__.get("__package__") or ""
        return importlib.import_module(resolve_name(name, package) if name.startswith(".") else name)
    except ImportError:
        return None


def installed(module: str | None) -> bool:
    """Whether a module belongs to Python, to fembeam, or to an installed package."""
    top = (module or "").partition(".")[0]
    file = getattr(sys.modules.get(module or ""), "__file__", None)
    if top in OURS or top == "__main__" or file is None:
        return top in OURS or (top != "__main__" and top in sys.stdlib_module_names)
    return any(Path(file).is_relative_to(place) for place in _places())


@functools.cache
def _places() -> tuple[str, ...]:
    """Folders of Python's own modules and of installed packages."""
    paths = sysconfig.get_paths()
    own = [paths[name] for name in ("stdlib", "platstdlib", "purelib", "platlib")]
    return (*own, *site.getsitepackages(), site.getusersitepackages())


@functools.cache
def version(module: str) -> str:
    """Version of the package a module belongs to; empty for Python's own, whose byte code differs by itself."""
    top = module.partition(".")[0]
    if top in OURS or top in sys.stdlib_module_names:
        return ""
    try:
        return str(getattr(sys.modules.get(top), "__version__", None) or metadata.version(top))
    except metadata.PackageNotFoundError:
        return ""
