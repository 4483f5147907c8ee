"""Named tuples of arrays handed to compiled code as one address.

Unboxing a tuple of arrays costs 0.15 µs per array and call, and passing it to a compiled function copies all its
descriptors. `Packed` writes the descriptors once and gives their address; in compiled code `unpacker` turns the address
into a value with the tuple's attributes, each of which is loaded where it is used.
"""

from __future__ import annotations

import ctypes
import math
import struct
from collections.abc import Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model

_META = [0, 0]  # owner and parent of an array: nobody, the tuple is kept alive by Python


class PackedType(types.Type):
    """Pointer to the descriptors of a named tuple's arrays."""

    def __init__(self, kind: types.NamedTuple) -> None:
        self.kind = kind
        super().__init__(name=f"Packed({kind.instance_class.__name__})")


register_model(PackedType)(models.OpaqueModel)


@infer_getattr
class _Attributes(AttributeTemplate):
    """Types of the attributes: those of the tuple."""

    key = PackedType

    def generic_resolve(self, packed: PackedType, name: str) -> Any:
        fields = packed.kind.fields
        return packed.kind.types[fields.index(name)] if name in fields else None


@lower_getattr_generic(PackedType)
def _attribute(context, builder, packed, value, name):
    """Load one array's descriptor, marked as constant memory, so that loops load it once."""
    index = packed.kind.fields.index(name)
    place = builder.bitcast(value, context.get_value_type(packed.kind).as_pointer())
    loaded = builder.load(builder.gep(place, [ir.IntType(32)(0), ir.IntType(32)(index)]))
    loaded.set_metadata("tbaa", _constant(builder.module))
    return loaded


def _constant(module):
    """The mark of constant memory for the compiler's type-based alias analysis."""
    long = ir.IntType(64)
    root = module.add_metadata([ir.MetaDataString(module, "fembeam")])
    kind = module.add_metadata([ir.MetaDataString(module, "descriptor"), root, long(0)])
    return module.add_metadata([kind, kind, long(0), long(1)])


def unpacker(kind: types.NamedTuple) -> Any:
    """The compiled function that turns the address of a packed named tuple into a value with its attributes."""

    @intrinsic
    def packed(typingctx, address):
        def codegen(context, builder, signature, arguments):
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return PackedType(kind)(types.int64), codegen

    return packed


_EXPECTED: dict[type, list[tuple[Any, int, Any]]] = {}  # by class: hashing a type of so many arrays takes long


def _expected(kind: types.NamedTuple) -> list[tuple[Any, int, Any]]:
    """Type, dimensions and dtype of every array of a named tuple; dtype None for a plain number."""
    if kind.instance_class not in _EXPECTED:
        _EXPECTED[kind.instance_class] = [
            (item, item.ndim, np.dtype(str(item.dtype))) if isinstance(item, types.Array) else (item, 0, None)
            for item in kind.types
        ]
    return _EXPECTED[kind.instance_class]


def address_of(array: Any) -> int:
    """Where the numbers of a contiguous array begin; `array.ctypes.data` says so too, but takes ten times as long."""
    if not array.size:
        return 0
    if not array.flags.writeable:
        return int(array.ctypes.data)
    return ctypes.addressof(ctypes.c_char.from_buffer(array))


_LINE = 8  # numbers in a line of the cache, of 64 bytes
_SLOW = 1 << 20  # numbers: what is read from far away gains nothing, and would be there twice for a while


def aligned(value: Any) -> Any:
    """A named tuple whose arrays begin at lines of the cache, so that eight numbers are read from one line, not two.

    Sampled runs with their balance take 0.91 to 0.97 of the time, others 0.95 to 1.00.
    """
    return value._make(_aligned(item) if 1 < np.size(item) < _SLOW else item for item in value)


def _aligned(array: Any) -> Any:
    """A copy that begins at a line of the cache."""
    room = np.empty(array.size + _LINE, dtype=array.dtype)
    first = -(address_of(room) // array.itemsize) % _LINE
    copy = room[first : first + array.size].reshape(array.shape)
    copy[...] = array
    return copy


def _described(value: Any, kind: types.NamedTuple) -> list[list[int]]:
    """For every field its 8-byte words: an array's descriptor, or the number itself."""
    return [_words(*field) for field in zip(value._fields, value, _expected(kind), strict=True)]


def _words(name: str, item: Any, kind: tuple[Any, int, Any]) -> list[int]:
    """Those of one field."""
    expected, ndim, dtype = kind
    if dtype is None:
        return [struct.unpack("q", struct.pack("d", item))[0]]
    if item.ndim != ndim or item.dtype != dtype or not item.flags.c_contiguous:
        raise TypeError(f"{name} must be a contiguous {expected}, got {item.dtype} with shape {item.shape}")
    return [*_META, item.size, 8, address_of(item), *item.shape, *item.strides]


_PLACES: dict[type, dict[str, int]] = {}


def _places(kind: types.NamedTuple) -> dict[str, int]:
    """Where the words of every field begin."""
    if kind.instance_class not in _PLACES:
        sizes = [1 if dtype is None else 5 + 2 * ndim for _, ndim, dtype in _expected(kind)]
        _PLACES[kind.instance_class] = dict(zip(kind.fields, np.cumsum([0, *sizes]).tolist(), strict=False))
    return _PLACES[kind.instance_class]


class Packed(NamedTuple):
    """A named tuple with the address of the descriptors of its arrays."""

    value: Any
    block: Any  # the descriptors; before them the own arrays of a copy made by `PackedTemplate`
    address: int

    @classmethod
    def of(cls, value: Any, kind: types.NamedTuple) -> Packed:
        """Pack a named tuple; TypeError for an array that is not of the declared kind."""
        block = np.array([*chain(*_described(value, kind))], dtype=np.int64)
        return cls(value, block, address_of(block))

    def replaced(self, kind: types.NamedTuple, **arrays: Any) -> Packed:
        """The same with other arrays in the place of some: a tenth of the time of packing all of them."""
        first = (self.address - address_of(self.block)) // 8
        block, places = self.block.view(np.int64)[first:].copy(), _places(kind)
        for name, array in arrays.items():
            words = _words(name, array, _expected(kind)[kind.fields.index(name)])
            block[places[name] : places[name] + len(words)] = words
        return Packed(self.value._replace(**arrays), block, address_of(block))

    @property
    def nbytes(self) -> int:
        """Of the memory that no other one shares."""
        return int(self.block.nbytes)


class PackedTemplate:
    """A named tuple to be packed many times: every copy has its own ``own`` arrays, all copies share the others."""

    def __init__(self, value: Any, kind: types.NamedTuple, own: Sequence[str]) -> None:
        self.value, described, self.places = value, _described(value, kind), _places(kind)
        arrays = [getattr(value, name) for name in own]
        ends = np.cumsum([array.size for array in arrays])
        self.slices = [
            (name, slice(end - array.size, end), array.shape)
            for name, array, end in zip(own, arrays, ends.tolist(), strict=True)
        ]
        self.size, self.own = int(ends[-1]), np.array([self.places[name] + 4 for name in own])
        self.offsets = 8 * (ends - [array.size for array in arrays])
        words = np.array([*chain(*described)], dtype=np.int64)
        self.block = np.concatenate([*(array.ravel() for array in arrays), words.view(float)])

    def copy(self, **numbers: float) -> Packed:
        """A new packed tuple with own arrays to write into, and with some plain numbers replaced."""
        block = self.block.copy()
        address = address_of(block)
        block[self.size :].view(np.int64)[self.own] = address + self.offsets
        for name, number in numbers.items():
            block[self.size + self.places[name]] = number
        arrays = {name: block[place].reshape(shape) for name, place, shape in self.slices}
        return Packed(self.value._replace(**arrays, **numbers), block, address + 8 * self.size)


def _descriptor(shape: tuple[int, ...], data: int) -> list[int]:
    """Descriptor of a contiguous array of eight-byte numbers, as compiled code reads it."""
    strides = [8 * math.prod(shape[i + 1 :]) for i in range(len(shape))]
    return [*_META, math.prod(shape), 8, data, *shape, *strides]


class Layout:
    """Named tuples whose arrays lie in one block of memory, each from a line of the cache on.

    All that a run writes to is one allocation.
    """

    def __init__(self, kinds: list[types.NamedTuple], shapes: list[list[tuple[int, ...]]]) -> None:
        words: list[int] = []
        data: list[int] = []
        self.starts: list[int] = []
        self.slices: list[list[tuple[slice, str, tuple[int, ...]]]] = []
        self.descriptors: list[list[int]] = []  # where they begin
        self.size = 0
        for kind, of_kind in zip(kinds, shapes, strict=True):
            self.starts.append(8 * len(words))
            self.slices.append([])
            self.descriptors.append([])
            for array, shape in zip(kind.types, of_kind, strict=True):
                self.descriptors[-1].append(len(words))
                data.append(len(words) + 4)
                words += _descriptor(shape, 8 * self.size)
                end = self.size + math.prod(shape)
                self.slices[-1].append((slice(self.size, end), str(array.dtype), shape))
                self.size = -(-end // _LINE) * _LINE
        self.words = np.array(words, dtype=np.int64)
        self.data = np.zeros_like(self.words)
        self.data[data] = 1

    def block(self) -> tuple[Any, int]:
        """A new block of zeros, with the descriptors of its arrays behind them, and the address of the descriptors."""
        room = np.zeros(self.size + self.words.size + _LINE)
        block = room[-(address_of(room) // 8) % _LINE :][: self.size + self.words.size]
        address = address_of(block)
        block[self.size :].view(np.int64)[:] = address * self.data + self.words
        return block, address + 8 * self.size

    def arrays(self, block: Any, i: int) -> list[Any]:
        """The arrays of the i-th tuple."""
        return [self.array(block, i, j) for j in range(len(self.slices[i]))]

    def array(self, block: Any, i: int, j: int) -> Any:
        """The j-th array of the i-th tuple."""
        place, kind, shape = self.slices[i][j]
        part = block[place] if kind == "float64" else block[place].view(kind)
        return part if len(shape) == 1 else part.reshape(shape)

    def replace_array(self, block: Any, i: int, j: int, array: Any) -> None:
        """Replace the j-th array of the i-th tuple by another of the same kind, which the caller must keep alive."""
        words = [*_META, array.size, 8, address_of(array), *array.shape, *array.strides]
        first = self.size + self.descriptors[i][j]
        block[first : first + len(words)].view(np.int64)[:] = words
