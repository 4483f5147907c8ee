"""Digests of functions and data: equal for the same, another one for whatever changes what is computed."""

import enum
import functools
import importlib
import os
import subprocess
import sys
import threading
from dataclasses import dataclass

import numpy as np
import pytest
from numba import njit

import fembeam as fb
from contacts import law
from fembeam.support.fingerprint import fingerprint


def made(text, name="f", **names):
    """The function of that name in a piece of code, with some global names."""
    space = {"np": np, "functools": functools, "__name__": "made", **names}
    exec(text, space)
    return space[name]


SAME_AND_OTHER = {
    "constant": ("f = lambda x: 2.0 * x", "f = lambda x: 3.0 * x"),
    "constant of another type": ("f = lambda x: 2 * x", "f = lambda x: 2.0 * x"),
    "operation": ("def f(x): return x + 1.0", "def f(x): return x - 1.0"),
    "attribute": ("f = lambda x: np.min(x)", "f = lambda x: np.max(x)"),
    "argument names": ("def f(x, y): return x", "def f(y, x): return y"),
    "default": ("def f(x, a=1.0): return a * x", "def f(x, a=2.0): return a * x"),
    "keyword default": ("def f(x, *, a=1.0): return a * x", "def f(x, *, a=2.0): return a * x"),
    "closure": ("def g(a): return lambda x: a * x\nf = g(1.0)", "def g(a): return lambda x: a * x\nf = g(2.0)"),
    "array in a closure": (
        "def g(a): return lambda x: a @ x\nf = g(np.zeros(3000))",
        "def g(a): return lambda x: a @ x\nf = g(np.eye(1, 3000, 1500)[0])",
    ),
    "global": ("A = 1.0\ndef f(x): return A * x", "A = 2.0\ndef f(x): return A * x"),
    "global in a nested function": (
        "A = 1.0\ndef f(x):\n def g(): return A * x\n return g()",
        "A = 2.0\ndef f(x):\n def g(): return A * x\n return g()",
    ),
    "global of a helper": (
        "A = [1.0]\ndef g(x): return A[0] * x\ndef f(x): return g(x)",
        "A = [2.0]\ndef g(x): return A[0] * x\ndef f(x): return g(x)",
    ),
    "helper": ("def g(x): return x\ndef f(x): return g(x)", "def g(x): return -x\ndef f(x): return g(x)"),
    "helper that takes turns": (
        "def g(x): return f(x - 1)\ndef f(x): return g(x) if x > 0 else 1.0",
        "def g(x): return f(x - 2)\ndef f(x): return g(x) if x > 0 else 1.0",
    ),
    "nested function": (
        "def f(x):\n def g(y): return y\n return g(x)",
        "def f(x):\n def g(y): return -y\n return g(x)",
    ),
    "comprehension": ("def f(x): return [2 * i for i in x]", "def f(x): return [3 * i for i in x]"),
    "partial": ("f = functools.partial(lambda x, a: a * x, a=1.0)", "f = functools.partial(lambda x, a: a * x, a=2.0)"),
    "function of a partial": (
        "f = functools.partial(lambda x, a: a * x, a=1.0)",
        "f = functools.partial(lambda x, a: a + x, a=1.0)",
    ),
    "bound method, state": (
        "class C:\n def __init__(self, a): self.a = a\n def g(self, x): return self.a * x\nf = C(1.0).g",
        "class C:\n def __init__(self, a): self.a = a\n def g(self, x): return self.a * x\nf = C(2.0).g",
    ),
    "bound method, code of another one": (
        "class C:\n def h(self): return 1.0\n def g(self, x): return self.h() * x\nf = C().g",
        "class C:\n def h(self): return 2.0\n def g(self, x): return self.h() * x\nf = C().g",
    ),
    "callable object": (
        "class C:\n a = 1.0\n def __call__(self, x): return self.a * x\nf = C()",
        "class C:\n a = 2.0\n def __call__(self, x): return self.a * x\nf = C()",
    ),
    "method of a base class": (
        "class B:\n def __call__(self, x): return x\nclass C(B): pass\nf = C()",
        "class B:\n def __call__(self, x): return -x\nclass C(B): pass\nf = C()",
    ),
    "slots": (
        "class C:\n __slots__ = ('a',)\n def __init__(self, a): self.a = a\nc = C(1.0)\ndef f(x): return c.a * x",
        "class C:\n __slots__ = ('a',)\n def __init__(self, a): self.a = a\nc = C(2.0)\ndef f(x): return c.a * x",
    ),
    "property": (
        "class C:\n @property\n def a(self): return 1.0\nc = C()\ndef f(x): return c.a * x",
        "class C:\n @property\n def a(self): return 2.0\nc = C()\ndef f(x): return c.a * x",
    ),
    "decorated": (
        "def d(g): return functools.wraps(g)(lambda x: g(x) + 1)\n@d\ndef f(x): return x",
        "def d(g): return functools.wraps(g)(lambda x: g(x) + 1)\n@d\ndef f(x): return -x",
    ),
    "decorator": (
        "def d(g): return functools.wraps(g)(lambda x: g(x) + 1)\n@d\ndef f(x): return x",
        "def d(g): return functools.wraps(g)(lambda x: g(x) - 1)\n@d\ndef f(x): return x",
    ),
    "cached": (
        "@functools.lru_cache\ndef g(x): return x\ndef f(x): return g(x)",
        "@functools.lru_cache\ndef g(x): return -x\ndef f(x): return g(x)",
    ),
    "function attribute": ("def f(x): return f.a * x\nf.a = 1.0", "def f(x): return f.a * x\nf.a = 2.0"),
    "generator of noise": (
        "r = np.random.default_rng(1)\ndef f(x): return r.normal()",
        "r = np.random.default_rng(2)\ndef f(x): return r.normal()",
    ),
    "exception handled": (
        "def f(x):\n try: return 1 / x\n except ValueError: return 0",
        "def f(x):\n try: return 1 / x\n except ZeroDivisionError: return 0",
    ),
}


@pytest.mark.parametrize("case", SAME_AND_OTHER)
def test_what_changes_a_function_changes_its_digest(case):
    one, other = SAME_AND_OTHER[case]
    assert fingerprint(made(one)) == fingerprint(made("\n\n" + one)) != fingerprint(made(other))


def test_what_does_not_matter_is_not_seen():
    one = made("A = 1.0\ndef f(x):\n y = x\n return y")
    assert fingerprint(one) == fingerprint(made("A = 2.0\ndef f(x):\n  z = x  # the same\n  return z"))


@enum.unique
class Side(enum.Enum):
    BELOW = 1
    ABOVE = 2


@dataclass(frozen=True)
class Pair:
    a: float
    b: object = None


VALUES = [
    None, False, 0, 0.0, -0.0, "0", b"0", 1, True, 1.0, 1j, (), [], {}, set(), (1,), [1], ((1,), 2), (1, (2,)),
    {"a": 1}, {"a": 2}, {"b": 1}, {1, 2}, {1, 3}, frozenset({1}), ..., range(3), range(4), slice(1, 2), Side.BELOW,
    Side.ABOVE, Pair(1.0), Pair(2.0), Pair(1.0, Pair(1.0)), float, int, np.float64, np.float64(1.0), np.zeros(2),
    np.zeros(2, dtype=int), np.zeros((2, 1)), np.array([0.0, -0.0]), np.array([1, "a"], dtype=object),
    np.array([1, "b"], dtype=object), np.sin, np.cos, np.mean, np.median, len, max, "a".join, "b".join, np, sys,
    np.dtype("f4"), np.random.SeedSequence(1), np.random.SeedSequence(2), fb.Beam, fb.Harmonic(1.0, 2.0),
    fb.Harmonic(1.0, 3.0), fb.BandNoise(1.0, (0.0, 9.0)), fb.BandNoise(1.0, (0.0, 9.0), seed=1),
]  # fmt: skip


def test_no_two_values_are_alike():
    assert len({fingerprint(value) for value in VALUES}) == len(VALUES)


def test_values_that_hold_themselves_end():
    loop = [1]
    loop.append(loop)
    other = [2]
    other.append(other)
    assert fingerprint(loop) == fingerprint(loop) != fingerprint(other)


def test_compiled_functions_are_told_by_their_source():
    texts = ("def g(x): return 2.0 * x", "def g(x): return 3.0 * x")
    one, same, other = (made("def f(x): return g(x)", g=njit(made(t, "g"))) for t in (texts[0], *texts))
    fast = made("def f(x): return g(x)", g=njit(fastmath=True)(made(texts[0], "g")))
    one(1.0)  # compiled by now
    assert fingerprint(one) == fingerprint(same)
    assert len({fingerprint(f) for f in (one, other, fast)}) == 3


LAW = "def cubic(delta, delta_dot, entry_rate, k=1e9):\n    return {} * k * delta**3"


def test_laws_are_told_by_their_code():
    made_laws = [law(made(LAW.format(a), "cubic")) for a in (1.0, 1.0, 2.0)]
    stops = [fb.Stop(0.2, law=make()) for make in made_laws]
    assert fingerprint(stops[0]) == fingerprint(stops[1]) != fingerprint(stops[2])
    assert fingerprint(made_laws[0]) == fingerprint(made_laws[1]) != fingerprint(made_laws[2])
    assert fingerprint(fb.Stop(0.2, law=made_laws[0](k=2e9))) != fingerprint(stops[0])
    by_global = [
        law(made("def cubic(delta, delta_dot, entry_rate):\n    return A * delta**3", "cubic", A=a))()
        for a in (1.0, 2.0)
    ]
    assert fingerprint(by_global[0]) != fingerprint(by_global[1])


HELPERS = "A = {a}\ndef g(x):\n    return A * x {b}\ndef unused():\n    return {c}\n"


@pytest.mark.parametrize(
    "text",
    [
        "import helpers\ndef f(x): return helpers.g(x)",
        "from helpers import g\ndef f(x): return g(x)",
        "def f(x):\n    from helpers import g\n    return g(x)",
    ],
)
def test_helpers_in_a_file_are_followed(tmp_path, monkeypatch, text):
    monkeypatch.syspath_prepend(tmp_path)

    def digest(**parts):
        (tmp_path / "helpers.py").write_text(HELPERS.format(**{"a": 1.0, "b": "", "c": 0, **parts}))
        sys.modules.pop("helpers", None)
        importlib.invalidate_caches()
        return fingerprint(made(text))

    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    first = digest()
    assert digest(c=1) == first
    assert len({first, digest(a=2.0), digest(b="+ 1")}) == 3


def test_a_module_used_as_a_whole_is_told_by_all_it_holds(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    found = []
    for c in (0, 1):
        (tmp_path / "helpers.py").write_text(HELPERS.format(a=1.0, b="", c=c))
        sys.modules.pop("helpers", None)
        importlib.invalidate_caches()
        found.append(fingerprint(made("def f(x):\n    import helpers\n    return getattr(helpers, x)()")))
    assert found[0] != found[1]


SCRIPT = """
import numpy as np, functools
from fembeam.support.fingerprint import fingerprint
from contacts import Hertz
words, table = {"a", "b", "c"}, {"x": np.arange(5.0), 2: {"p", "q"}}
class C:
    def __call__(self, x, law=Hertz(1e8)): return x in words or table
def f(x, c=C()): return [c(i) for i in x if i in {"u", "v", "w"}]
print(fingerprint(functools.partial(f, c=C())))
"""


def test_digests_are_those_of_other_processes(capsys):
    """Another one with hashes of its own; where this one has the same by chance, that happens once."""
    command, environment = [sys.executable, "-c", SCRIPT], {**os.environ, "PYTHONHASHSEED": "1"}
    other = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout
    exec(SCRIPT, {"__name__": "__main__"})
    assert capsys.readouterr().out == other


def refused():
    """Functions that read what cannot be told from another of its kind."""
    lock, numbers = threading.Lock(), (i for i in range(3))
    return {"lock": lambda x: lock.acquire(), "numbers": lambda x: next(numbers), "file": lambda x: sys.stdin.read()}


@pytest.mark.parametrize(("name", "kind"), [("lock", "_thread.lock"), ("numbers", "builtins.generator")])
def test_what_cannot_be_told_apart_is_refused(name, kind):
    message = f"the quantity → {name} is a {kind}, which cannot be told from another one .*leave out checkpoint="
    with pytest.raises(ValueError, match=message):
        fingerprint(refused()[name], "the quantity")
