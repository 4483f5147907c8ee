"""What numba does again and again as it compiles, or for nobody: 0.54 of the time is left.

- A builtin such as ``operator.mul`` is typed by trying all its templates, overloads of strings and lists among them,
  at every place where it stands. The signature depends on the types of the arguments alone, unless an overload has made
  it, which is compiled by the caller's options: all others are remembered.
- A function merged into its caller is copied twice before, lest what others share be changed. It was read for this one
  place, and nobody asks for the second copy.
- A function that only others call is linked into these, optimised there once more, and then made machine code of. By
  itself it needs neither: it has no wrapper that Python or C could call. This leaves 0.7 of the time. What is optimised
  once, as a whole, is no slower: the methods of `stepping` take 0.8 to 0.9 of the time, the main one 0.98 to 1.
- A branch that the type of an argument excludes is compiled all the same, for the optimiser to leave out: for lines all
  of circles and friction. Where a function `known_by_type` decides, the branch is left out first: 0.86 of the time.

These are methods of numba, replaced while functions of this package are compiled. One is replaced for good: the place
of a function's environment, which it needs to raise exceptions, is missing where it has no machine code of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

from numba.core import event, inline_closurecall, ir
from numba.core.codegen import CPUCodeLibrary, JITCodeLibrary, JITCPUCodegen
from numba.core.inline_closurecall import InlineWorker
from numba.core.ir_utils import get_definition, guard
from numba.core.types.functions import BaseFunction
from numba.core.untyped_passes import InlineInlinables

_KNOWN = "_signatures_by_types"
_ENVIRONMENT, _WRAPPERS = "_ZN08NumbaEnv7solvers", ("_ZN7cpython", "cfunc.")  # how names in a function's code begin
_typed, _merged = BaseFunction.get_call_type, InlineWorker.inline_function
_finished, _set_environment = JITCodeLibrary._finalize_final_module, JITCPUCodegen.set_env
_optimised, _inlined = CPUCodeLibrary._optimize_final_module, InlineInlinables.run_pass
_ANSWERS: dict[Any, Callable[[Any], bool | None]] = {}


def _remembered(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """The signature of a call."""
    known, key = self.__dict__.setdefault(_KNOWN, {}), (args, *kws.items())
    if key not in known:
        signature: Any = _typed(self, context, args, kws)
        if self._impl_keys[signature.args] is not self.typing_key:  # made by an overload
            return signature
        known[key] = signature
    return known[key]


def _merged_itself(self: Any, *place: Any, **options: Any) -> Any:
    """A function merged at a place of its caller, without copies."""
    with patch.object(inline_closurecall, "copy", SimpleNamespace(deepcopy=lambda block: block)):
        return _merged(self, *place, **options)


def known_by_type(answer: Callable[[Any], bool | None]) -> Callable[[Any], Any]:
    """Decorator of a compiled function whose value may be known from its first argument's type, then ``answer``."""

    def known(function: Any) -> Any:
        _ANSWERS[function] = answer
        return function

    return known


def _answer(func_ir: Any, arguments: Any, value: Any) -> bool | None:
    """The value of an expression, if it is a call of such a function with something of a known type."""
    if not (isinstance(value, ir.Expr) and value.op == "call" and value.args):
        return None
    function = getattr(guard(get_definition, func_ir, value.func), "value", None)
    if not (isinstance(function, Hashable) and function in _ANSWERS):
        return None
    return _ANSWERS[function](_type_of(func_ir, arguments, value.args[0]))


def _type_of(func_ir: Any, arguments: Any, name: Any) -> Any:
    """The type of an argument of the caller, or of a field of one, also of several fields read in one line; or None."""
    value = guard(get_definition, func_ir, name)
    if isinstance(value, ir.Arg):
        return arguments[value.index]
    if not isinstance(value, ir.Expr):
        return None
    if value.op == "getattr":
        owner = _type_of(func_ir, arguments, value.value)
        fields = getattr(owner, "fields", ())
        return owner.types[fields.index(value.attr)] if value.attr in fields else None
    if value.op == "static_getitem":
        line: Any = guard(get_definition, func_ir, value.value)
        line = guard(get_definition, func_ir, line.value) if getattr(line, "op", "") == "exhaust_iter" else None
        if getattr(line, "op", "") == "build_tuple":
            return _type_of(func_ir, arguments, line.items[value.index])
    return None


def _inlined_and_answered(self: Any, state: Any) -> Any:
    """Merge functions, then write down what is known by types; numba prunes branches on constants next."""
    changed, func_ir = _inlined(self, state), state.func_ir
    for block in func_ir.blocks.values():
        for statement in block.find_insts(ir.Assign):
            answer = _answer(func_ir, state.args, statement.value)
            if answer is not None:
                known = func_ir._definitions[statement.target.name]
                known[known.index(statement.value)] = statement.value = ir.Const(answer, statement.loc)
    return changed


def _is_only_linked(module: Any) -> bool:
    """Whether a module holds a function of these packages, and none that could be called from outside."""
    if not any(variable.name.startswith(_ENVIRONMENT) for variable in module.global_variables):
        return False
    return not any(each.name.startswith(_WRAPPERS) and not each.is_declaration for each in module.functions)


def _optimised_if_called(self: Any) -> None:
    """Optimise a module, where this is not done in others."""
    if not _is_only_linked(self._final_module):
        _optimised(self)


def _finished_if_called(self: Any) -> None:
    """Machine code of a module, where it is needed."""
    if _is_only_linked(self._final_module):
        self._finalize_dynamic_globals()
        self._compiled_object, self._finalized = b"", True  # to keep it asks for the code
    else:
        _finished(self)


def _set_environment_if_there(self: Any, name: str, environment: Any) -> None:
    """Write a function's environment to its place in the machine code."""
    if self._engine.get_global_value_address(name):
        _set_environment(self, name, environment)


JITCPUCodegen.set_env = _set_environment_if_there

_METHODS: dict[type, Any] = {
    InlineInlinables: ("run_pass", _inlined, _inlined_and_answered),
    CPUCodeLibrary: ("_optimize_final_module", _optimised, _optimised_if_called),
    JITCodeLibrary: ("_finalize_final_module", _finished, _finished_if_called),
    BaseFunction: ("get_call_type", _typed, _remembered),
    InlineWorker: ("inline_function", _merged, _merged_itself),
}


class Shortcuts(event.Listener):
    """Counts what is being compiled, and takes the shortcuts from the first on to the last."""

    def __init__(self, ours: Callable[[Any], bool]) -> None:
        self._ours, self._count = ours, 0
        self._began: list[bool] = []  # functions that numba compiles, one within the other: whether they are ours

    def _add(self, number: int) -> None:
        """So many more are being compiled."""
        self._count += number
        for owner, (name, own, short) in _METHODS.items():
            setattr(owner, name, short if self._count > 0 else own)

    def on_start(self, found: Any) -> None:
        """Numba compiles a function."""
        self._began.append(self._ours(found.data["dispatcher"].py_func))
        self._add(int(self._began[-1]))

    def on_end(self, _: Any) -> None:
        """It is compiled."""
        self._add(-int(self._began.pop()))

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Compile within."""
        self._add(1)
        try:
            yield
        finally:
            self._add(-1)
