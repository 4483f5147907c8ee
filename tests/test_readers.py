"""Files of other programs, made here from the description of each format: whole, truncated and foreign ones."""

import contextlib
import struct

import numpy as np
import pytest
from scipy import io, sparse

from fembeam.structures import Scale, Structure
from fembeam.structures.readers import read_matrices, read_nodes

NAMES = ("x", "y", "z", "rx", "ry", "rz")
LABELS = ((3, "x"), (3, "z"), (7, "y"), (11, "ry"))
K = 1e6 * np.array([[4.0, -1.5, 0.0, 0.25], [-1.5, 3.0, -1.0, 0.0], [0.0, -1.0, 2.0, 0.125], [0.25, 0.0, 0.125, 1.0]])
M = np.diag([2.0, 2.0, 1.0, 0.5])
M[0, 1] = M[1, 0] = 0.1


def entries(matrix, part="lower"):
    """(row, column, value) from 0 of a triangle, or all."""
    rows, columns = np.nonzero({"lower": np.tril, "upper": np.triu, "all": np.asarray}[part](matrix))
    return [(i, j, float(matrix[i, j])) for i, j in zip(rows.tolist(), columns.tolist(), strict=True)]


def written(folder, name, content):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def check(given, matrix=K, labels=LABELS, name=None, rtol=1e-15):
    np.testing.assert_allclose(given.matrix(name).toarray(), matrix, rtol=rtol)
    assert given.labels == labels


# --- npz, Matrix Market -----------------------------------------------------------------------------------------------


def test_npz(tmp_path):
    coo, path = sparse.coo_array(M), tmp_path / "two.npz"
    np.savez(path, K=K, M_data=coo.data, M_row=coo.row, M_col=coo.col, labels=np.array(LABELS), note=np.arange(3))
    check(read_matrices(path), name="K")
    check(read_matrices(path), M, name="m")
    sparse.save_npz(tmp_path / "K.npz", sparse.csc_matrix(K))
    check(read_matrices(tmp_path / "K.npz"), labels=None)


def test_npz_is_refused_in_words(tmp_path):
    good = tmp_path / "good.npz"
    np.savez(good, K=K, labels=np.array(LABELS))
    whole = good.read_bytes()
    with pytest.raises(ValueError, match=r"cut.npz, as a whole: expected arrays of numbers in a .npz"):
        read_matrices(written(tmp_path, "cut.npz", whole[: len(whole) // 2]))
    one = tmp_path / "one.npz"
    sparse.save_npz(one, sparse.csc_matrix(K))
    for at in range(40, len(one.read_bytes()), 7):  # damaged anywhere: refused, or read as it was
        damaged = bytearray(one.read_bytes())
        damaged[at] ^= 0xFF
        with contextlib.suppress(ValueError):
            check(read_matrices(written(tmp_path, "damaged.npz", bytes(damaged))), labels=None)
    np.savez(tmp_path / "objects.npz", K=np.array([{}], dtype=object))
    with pytest.raises(ValueError, match=r"expected arrays of numbers in a .npz, got something else"):
        read_matrices(tmp_path / "objects.npz")
    np.savez(tmp_path / "name.npz", K=K, labels=np.array([(1, "x"), (2, "x"), (3, "u"), (4, "x")]))
    with pytest.raises(ValueError, match=r"labels\[2\]: expected a node and one of x, .* rz or 1 to 6, got 3 u"):
        read_matrices(tmp_path / "name.npz")
    np.savez(tmp_path / "flat.npz", K=np.arange(3.0))
    with pytest.raises(ValueError, match=r"expected square arrays, or K_data with K_row and K_col, got K"):
        read_matrices(tmp_path / "flat.npz")


@pytest.mark.parametrize("suffix", [".mtx", ".mm", ".txt"])
def test_matrix_market(tmp_path, suffix):
    lines = ["%%MatrixMarket matrix coordinate real symmetric", "% a comment", "4 4 8"]
    lines += [f"{i + 1} {j + 1} {value!r}" for i, j, value in entries(K)]
    check(read_matrices(written(tmp_path, f"K{suffix}", "\n".join(lines))), labels=None)


def test_matrix_market_of_scipy(tmp_path):
    io.mmwrite(tmp_path / "dense.mtx", K)
    check(read_matrices(tmp_path / "dense.mtx"), labels=None)


# --- op4 --------------------------------------------------------------------------------------------------------------


def runs(column):
    """(first row from 1, values) of the stretches without zeros."""
    found, i = [], 0
    while i < len(column):
        j = i
        while j < len(column) and column[j]:
            j += 1
        if j > i:
            found.append((i + 1, column[i:j]))
        i = max(j, i + 1)
    return found


def op4_binary(named, order="<", layout="dense", word=4, single=False):
    """Records of OUTPUT4, from its description."""
    integer, number = order + ("i" if word == 4 else "q"), order + ("f" if single and word == 4 else "d")
    size, out = struct.calcsize(number) // word, []

    def record(*parts):
        body = b"".join(parts)
        out.append(struct.pack(f"{order}i", len(body)) + body + struct.pack(f"{order}i", len(body)))

    def whole(*numbers):
        return b"".join(struct.pack(integer, n) for n in numbers)

    def values(numbers):
        return b"".join(struct.pack(number, n) for n in numbers)

    for name, matrix in named:
        rows, columns = matrix.shape
        text = f"{name:8s}".encode()
        text = text if word == 4 else text[:4] + b"    " + text[4:] + b"    "
        record(whole(columns, -rows if layout == "bigmat" else rows, 6, 1 if single else 2), text)
        for j, column in enumerate(matrix.T, 1):
            found = runs(column)
            if layout == "dense":
                first, last = found[0][0], found[-1][0] + len(found[-1][1]) - 1
                record(whole(j, first, size * (last - first + 1)), values(column[first - 1 : last]))
                continue
            strings = []
            for first, part in found:
                words = size * len(part) + 1
                head = whole(words, first) if layout == "bigmat" else whole(first + 65536 * words)
                strings.append(head + values(part))
            record(whole(j, 0, sum(map(len, strings)) // word), *strings)
        record(whole(columns + 1, 1, size), values([1.0]))
    return b"".join(out)


def op4_text(named, layout="dense", letter="E"):
    """The same as text: values of 1P,3E23.16."""
    lines = []

    def values(numbers):
        words = [f"{n:23.16E}".replace("E", letter) for n in numbers]
        lines.extend("".join(words[i : i + 3]) for i in range(0, len(words), 3))

    for name, matrix in named:
        rows, columns = matrix.shape
        lines.append(f"{columns:8d}{-rows if layout == 'bigmat' else rows:8d}{6:8d}{2:8d}{name:8s}1P,3{letter}23.16")
        for j, column in enumerate(matrix.T, 1):
            found = runs(column)
            if layout == "dense":
                first, last = found[0][0], found[-1][0] + len(found[-1][1]) - 1
                lines.append(f"{j:8d}{first:8d}{last - first + 1:8d}")
                values(column[first - 1 : last])
                continue
            heads = 2 if layout == "bigmat" else 1
            lines.append(f"{j:8d}{0:8d}{sum(heads + 2 * len(part) for _, part in found):8d}")
            for first, part in found:
                words = 2 * len(part) + 1
                lines.append(f"{words:8d}{first:8d}" if layout == "bigmat" else f"{first + 65536 * words:8d}")
                values(part)
        lines.append(f"{columns + 1:8d}{1:8d}{1:8d}")
        values([1.0])
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("layout", ["dense", "bigmat", "strings"])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("word", "single"), [(4, False), (4, True), (8, False), (8, True)])
def test_binary_op4(tmp_path, order, layout, word, single):
    path = written(tmp_path, "km.op4", op4_binary([("KAA", K), ("MAA", M)], order, layout, word, single))
    check(read_matrices(path), labels=None, name="KAA", rtol=1e-7 if single and word == 4 else 1e-15)
    check(read_matrices(path), M, None, "maa", rtol=1e-7 if single and word == 4 else 1e-15)


@pytest.mark.parametrize("layout", ["dense", "bigmat", "strings"])
@pytest.mark.parametrize("letter", ["E", "D"])
def test_text_op4(tmp_path, layout, letter):
    path = written(tmp_path, "km.op4", op4_text([("KAA", K), ("MAA", -M)], layout, letter))
    check(read_matrices(path), labels=None, name="KAA")
    check(read_matrices(path), -M, None, "MAA")


def test_op4_names_that_repeat_and_diagonals(tmp_path):
    given = read_matrices(written(tmp_path, "two.op4", op4_binary([("KAA", K), ("KAA", M)])))
    assert [name for name, _ in given.matrices] == ["KAA", "KAA"]
    with pytest.raises(ValueError, match=r"two.op4: expected a matrix 'KAA' that is there once, found KAA, KAA"):
        given.matrix("KAA")
    with pytest.raises(ValueError, match=r"expected one matrix, found KAA, KAA; give \(path, name\)"):
        given.matrix()
    diagonal = op4_text([("MAA", np.diag(M)[:, None])]).replace(f"{6:8d}{2:8d}MAA", f"{3:8d}{2:8d}MAA")
    check(read_matrices(written(tmp_path, "d.op4", diagonal)), np.diag(np.diag(M)), None)


@pytest.mark.parametrize("layout", ["dense", "bigmat", "strings"])
def test_truncated_op4_names_the_place(tmp_path, layout):
    """Wherever a file ends, it is refused with the byte or line, and never read as a smaller matrix."""
    binary, text = op4_binary([("KAA", K)], ">", layout), op4_text([("KAA", K)], layout).splitlines()
    for end in range(5, len(binary) - 1, 7):
        with pytest.raises(ValueError, match=r"cut.op4, byte \d+: expected"):
            read_matrices(written(tmp_path, "cut.op4", binary[:end]))
    for end in range(1, len(text) - 1):
        with pytest.raises(ValueError, match=r"cut.op4, line \d+: expected"):
            read_matrices(written(tmp_path, "cut.op4", "\n".join(text[:end])))


def test_damaged_heads_of_op4_take_no_memory(tmp_path):
    """Of rows of 1.6 PiB there was a MemoryError."""
    whole = op4_binary([("K", K)], ">", "bigmat", 8)
    at = whole.index(struct.pack(">q", -len(K)))
    with pytest.raises(ValueError, match="byte 0: expected the head of a matrix"):
        read_matrices(written(tmp_path, "a.op4", whole[:at] + struct.pack(">q", 1 << 48) + whole[at + 8 :]))


# --- DMIG -------------------------------------------------------------------------------------------------------------


def dmig(named, form=6):
    """Punched cards of large fields, D exponents, nine decimals, one triangle."""
    lines = ["$ a comment", "GRID           3              0.0     1.0     2.0"]
    for name, matrix in named:
        lines.append(f"DMIG    {name:8s}{0:8d}{form:8d}{2:8d}{0:8d}")
        part = np.tril(matrix) if form == 6 else matrix
        for j, (node, c) in enumerate(LABELS):
            lines.append(f"DMIG*   {name:16s}{node:16d}{NAMES.index(c) + 1:16d}")
            for i in np.flatnonzero(part[:, j]):
                value = f"{part[i, j]:16.9E}".replace("E", "D")
                lines.append(f"*       {LABELS[i][0]:16d}{NAMES.index(LABELS[i][1]) + 1:16d}{value}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("form", [1, 6])
def test_dmig(tmp_path, form):
    given = read_matrices(written(tmp_path, "km.pch", dmig([("KAAX", K), ("MAAX", M)], form)))
    check(given, name="KAAX", rtol=1e-9)
    check(given, M, name="MAAX", rtol=1e-9)


def test_dmig_of_small_and_free_fields(tmp_path):
    lines = ["DMIG,K,0,6,1,0", "DMIG,K,1,1,,1,1,2.5+3", ",2,1,-1.0D3", "DMIG    K              2       1        "
             "       2       1  3.5+3"]  # fmt: skip
    check(read_matrices(written(tmp_path, "k.dmig", "\n".join(lines))), [[2500.0, -1000.0], [-1000.0, 3500.0]],
          ((1, "x"), (2, "x")))  # fmt: skip


def test_dmig_names_scalar_points_modes(tmp_path):
    lines = dmig([("K", K)]).replace(f"{11:16d}{5:16d}", f"{11:16d}{0:16d}")
    assert read_matrices(written(tmp_path, "k.pch", lines)).labels[-1] == (11, "mode")


# --- Abaqus -----------------------------------------------------------------------------------------------------------


def abaqus(matrix, layout, part="lower", labels=LABELS):
    lines = ["** generated", "*MATRIX INPUT, NAME=K"] if layout == "input" else []
    for i, j, value in entries(matrix, part):
        a, b = ((node, NAMES.index(c) + 1) for node, c in (labels[i], labels[j]))
        if layout == "coordinate":
            lines.append(f"{i + 1:8d} {j + 1:8d} {value:24.16e}")
        elif layout == "labels":
            lines.append(f"{a[0]:8d} {a[1]} {b[0]:8d} {b[1]} {value:24.16e}")
        else:
            lines.append(f"{a[0]},{a[1]}, {b[0]},{b[1]}, {value:.16e}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("part", ["lower", "upper", "all"])
@pytest.mark.parametrize("layout", ["input", "labels", "coordinate"])
def test_abaqus(tmp_path, layout, part):
    given = read_matrices(written(tmp_path, "job_STIF2.mtx", abaqus(K, layout, part)))
    check(given, labels=None if layout == "coordinate" else LABELS)


def test_a_triangle_in_the_order_of_the_file_is_mirrored_whole(tmp_path):
    """Another order of equations than that of nodes, and form 6 of DMIG, put entries on both sides of the diagonal."""
    order = (2, 0, 3, 1)
    turned, labels = K[np.ix_(order, order)], [LABELS[i] for i in order]
    check(read_matrices(written(tmp_path, "K.mtx", abaqus(turned, "input", labels=labels))))
    lines = ["DMIG,K,0,6,2,0"]
    for i, j, value in entries(turned):
        (node, c), (other, d) = labels[i], labels[j]
        lines.append(f"DMIG,K,{other},{NAMES.index(d) + 1},,{node},{NAMES.index(c) + 1},{value!r}")
    check(read_matrices(written(tmp_path, "K.pch", "\n".join(lines))))
    lopsided = abaqus(K, "input", "all") + "3,1, 7,2, 1.0\n"
    assert read_matrices(written(tmp_path, "L.mtx", lopsided)).matrix(None)[2, 0] == 0.0  # not symmetric, and left so


@pytest.mark.parametrize("layout", ["input", "coordinate"])
def test_held_dofs_of_abaqus_are_left_out_of_both(tmp_path, layout):
    held = K.copy()
    held[1, :] = held[:, 1] = 0.0
    held[1, 1] = 1e36
    both = ("K", held), ("M", M)
    path, mass = (written(tmp_path, f"job_{name}.mtx", abaqus(matrix, layout)) for name, matrix in both)
    given, free = read_matrices(path), [0, 2, 3]
    check(given, K[np.ix_(free, free)], None if layout == "coordinate" else tuple(LABELS[i] for i in free))
    assert given.held == ((1,) if layout == "coordinate" else (LABELS[1],))
    body = Structure.read(path, mass)
    np.testing.assert_allclose(body.M.toarray(), M[np.ix_(free, free)])


# --- CalculiX, Ansys --------------------------------------------------------------------------------------------------


def test_calculix(tmp_path):
    dof = "".join(f"{node}.{NAMES.index(c) + 1}\n" for node, c in LABELS)
    written(tmp_path, "job.dof", dof)
    for name, matrix, part in (("job.sti", K, "upper"), ("job.mas", M, "lower")):
        text = "".join(f"{i + 1} {j + 1} {value:20.13e}\n" for i, j, value in entries(matrix, part))
        check(read_matrices(written(tmp_path, name, text)), matrix)
    written(tmp_path, "job.dof", "3.1\n3-3\n")
    with pytest.raises(ValueError, match=r"job.dof, line 2: expected node.dof, such as 12.3, got '3-3'"):
        read_matrices(tmp_path / "job.mas")


def harwell_boeing(matrix, kind="RSA", part="lower"):
    """Columns by pointers; formats as Ansys has them."""
    by_column = sorted(entries(matrix, part), key=lambda one: (one[1], one[0]))
    pointers = np.concatenate([[1], 1 + np.cumsum([sum(j == c for _, j, _ in by_column) for c in range(len(matrix))])])

    def block(numbers, each, form):
        words = [form % n for n in numbers]
        return ["".join(words[i : i + each]) for i in range(0, len(words), each)]

    parts = [block(pointers, 8, "%10d"), block([i + 1 for i, _, _ in by_column], 8, "%10d"),
             [line.replace("E", "D") for line in block([v for _, _, v in by_column], 3, "%25.16E")]]  # fmt: skip
    counts = [len(one) for one in parts]
    head = [f"{'Ansys matrix':72s}STIFF", "".join(f"{n:14d}" for n in (sum(counts), *counts, 0)),
            f"{kind:14s}" + "".join(f"{n:14d}" for n in (len(matrix), len(matrix), len(by_column), 0)),
            f"{'(8I10)':16s}{'(8I10)':16s}{'(1P,3D25.16)':20s}{'':20s}"]  # fmt: skip
    return "\n".join([*head, *(line for one in parts for line in one)]) + "\n"


MAPPING = "       Matrix Eqn         Node        DOF\n" + "".join(
    f"{i:12d}{node:12d}   {name}\n" for i, (node, name) in enumerate([(3, "UX"), (3, "UZ"), (7, "UY"), (11, "ROTY")], 1)
)


@pytest.mark.parametrize(("kind", "part"), [("RSA", "lower"), ("RSA", "all"), ("RUA", "all")])
def test_harwell_boeing(tmp_path, kind, part):
    path = written(tmp_path, "job.matrix", harwell_boeing(K, kind, part))
    check(read_matrices(path), labels=None)
    written(tmp_path, "job.mapping", MAPPING)
    check(read_matrices(path))


def test_harwell_boeing_of_scipy(tmp_path):
    io.hb_write(tmp_path / "K.hb", sparse.csc_matrix(K / 3.0))  # fields narrower than its head says
    check(read_matrices(tmp_path / "K.hb"), K / 3.0, labels=None)
    check(read_matrices(written(tmp_path, "one.matrix", harwell_boeing(K[:1, :1]))), K[:1, :1], labels=None)


def test_harwell_boeing_is_refused_in_words(tmp_path):
    lines = harwell_boeing(K).splitlines()
    for end in (2, 4, 5, len(lines) - 1):
        with pytest.raises(ValueError, match=rf"cut.hb, line {max(end, 2) + (end > 2)}: expected"):
            read_matrices(written(tmp_path, "cut.hb", "\n".join(lines[:end])))
    for number, old, new in ((3, f"{'RSA':14s}{4:14d}{4:14d}", f"{'RSA':14s}{4:14d}"), (4, "(8I10)", "(0I10)")):
        damaged = "\n".join(lines).replace(old, new, 1).replace(f"{0:14d}\n(", "\n(")
        with pytest.raises(ValueError, match=rf"bad.hb, line {number}: expected"):
            read_matrices(written(tmp_path, "bad.hb", damaged))
    written(tmp_path, "job.mapping", MAPPING.replace("ROTY", "TEMP"))
    with pytest.raises(ValueError, match=r"job.mapping, line 5: expected .*, node and one of UX, .*got '4 .*TEMP'"):
        read_matrices(written(tmp_path, "job.matrix", harwell_boeing(K)))
    written(tmp_path, "job.mapping", "\n".join(MAPPING.splitlines()[:-1]))
    with pytest.raises(ValueError, match=r"expected equations 1 to 4, each once, got 3 of them up to 3"):
        read_matrices(tmp_path / "job.matrix")


# --- one entry, structures --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "content",
    [op4_binary([("K", K)]), op4_binary([("K", K)], ">", "bigmat", 8), dmig([("K", K)]), harwell_boeing(K)],
    ids=["op4", "op4, 8 bytes", "dmig", "harwell-boeing"],
)
def test_files_without_a_known_suffix_are_judged_by_how_they_begin(tmp_path, content):
    np.testing.assert_allclose(read_matrices(written(tmp_path, "K.out", content)).matrix().toarray(), K, rtol=1e-9)


OP4, DMIG, INPUT = (text.splitlines() for text in (op4_text([("KAA", K)]), dmig([("K", K)]), abaqus(K, "input")))
MARKET = [
    "%%MatrixMarket matrix coordinate real symmetric",
    "4 4 8",
    *(f"{i + 1} {j + 1} {v!r}" for i, j, v in entries(K)),
]


@pytest.mark.parametrize(
    ("name", "lines", "message"),
    [
        ("a.pdf", ["%PDF-1.4 nothing of this kind"], "a.pdf, its suffix: expected one of .dmig, .hb, .*, got '.pdf'"),
        ("K.txt", ["2.0 -1.0", "-1.0 1.0"], "got '.txt'; rows of numbers as text are read by numpy.loadtxt"),
        ("a.op4", [], "a.op4, byte 0: expected a matrix, got an empty file"),
        ("k.mtx", MARKET[:-2], "k.mtx, line 8: expected the last of 8 entries, got the last of 6"),
        ("k.mm", [*MARKET[:3], "2 1 "], "k.mm, line 4: expected row, column, value, got '2 1 '"),
        ("k.txt", [*MARKET[:2], "5 1 1.0", *MARKET[3:]],
         "k.txt, line 3: expected a row from 1 to 4 and a column from 1 to 4, got '5 1 1.0'"),
        ("k.mtx", [MARKET[0], "4 4"], "k.mtx, line 2: expected rows, columns, entries, got '4 4'"),
        ("k.mtx", [MARKET[0], "3 4 1", "1 1 2"], "line 2: expected as many rows as columns of a"),
        ("k.mtx", ["%%MatrixMarket matrix array real symmetric", "2 1", "5"], "line 2: expected as many rows as"),
        ("k.mtx", ["%%MatrixMarket matrix coordinate complex hermitian", "1 1 1", "1 1 1 0"],
         "k.mtx, line 1: expected a real matrix, general or symmetric, got complex"),
        ("k.op4", ["hello world"], "k.op4, line 1: expected the head of a matrix, got 'hello world'"),
        ("k.op4", [OP4[0], f"{1:8d}{2:8d}{4:8d}", *OP4[2:]], "rows 1 to 4 of KAA, got column 1, rows 2 to 5"),
        ("k.op4", [OP4[0].replace(f"{2:8d}KAA", f"{4:8d}KAA"), *OP4[1:]],
         "as a whole: expected a real matrix, got KAA"),
        ("k.pch", ["DMIG    KAAX           0       6       2       0"],
         r"expected columns of KAAX after its head, got none; is the file truncated"),
        ("k.pch", DMIG[:4], "k.pch, line 4: expected entries of this column, got the end; is the file truncated"),
        ("k.pch", [*DMIG[:2], *DMIG[3:]],
         "k.pch, line 3: expected a head DMIG, name, 0, form, type before the columns, got K"),
        ("k.pch", [*DMIG[:4], f"*       {3:16d}{7:16d} 1.0"],
         r"line 5: expected a dof from 1 to 6 \(x y z rx ry rz\), got dof 7 of node 3"),
        ("k.pch", [*DMIG[:4], f"*       {3:16d}{1:16d} 1.0X"],
         "line 5: expected grid, component and value, got 3, 1, 1.0X"),
        ("k.pch", [dmig([("K", K)], 9)], r"DMIG cards of a real matrix of form 1 or 6, got K \(form 9, type 2\)"),
        ("k.pch", ["GRID,1,,0.,0.,0."], "expected DMIG cards of a real matrix of form 1 or 6, got none"),
        ("k.mtx", [abaqus(K, "input", labels=[(-1, "x"), *LABELS[1:]])],
         "line 3: expected positive labels, got -1: 1 internal nodes, which make K indefin"),
        ("k.mtx", [*INPUT[:5], "3,1, 3,3"], "line 6: expected node, dof, node, dof, value, got '3,1, 3,3'"),
        ("k.mtx", ["*USER ELEMENT, NODES=2", "1,2", "*MATRIX, TYPE=STIFFNESS", "1.0"],
         r"expected a matrix of \*MATRIX OUTPUT, got one of a substructure or user element"),
        ("k.mtx", ["1, 3,1, 3,1, 4e6"], r"got 6 words; element by element\?"),
        ("k.mtx", ["3,11, 3,11, 4e6"], r"line 1 on: expected a dof from 1 to 6 .*, got dof 11 of node 3"),
        ("k.mtx", ["** nothing"], "line 1: expected row, column, value or node, dof, node, dof, value, got no entries"),
        ("job.sti", ["1 1 1.0", "5 1 1.0"],
         "job.sti, line 2: expected row and column from 1 to 4, value, got '5 1 1.0'"),
        ("job.sti", ["1 1"], "job.sti, line 1: expected row, column, value, got '1 1'"),
        ("k.sti", ["1 1 1.0"], "k.sti, beside it: expected k.dof, which names the rows, got no such file"),
        ("k.hb", [harwell_boeing(K, "CSA")], "line 3: expected a real assembled matrix, RSA or RUA, got 'CSA'"),
    ],
)  # fmt: skip
def test_files_are_refused_in_words(tmp_path, name, lines, message):
    written(tmp_path, "job.dof", "".join(f"{node}.{NAMES.index(c) + 1}\n" for node, c in LABELS))
    with pytest.raises(ValueError, match=message):
        read_matrices(written(tmp_path, name, "\n".join(lines)))


def test_a_file_that_is_missing_is_missing(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_matrices(tmp_path / "none.op4")


def test_structure_from_op4_and_a_bulk_file(tmp_path):
    """A dof for each of six components of every GRID, ascending; units of millimetres, tonnes and seconds."""
    rng = np.random.default_rng(0)
    root = rng.normal(size=(12, 12))
    stiff, mass = root @ root.T, np.diag(rng.uniform(1.0, 2.0, 12))
    path = written(tmp_path, "km.op4", op4_binary([("KGG", stiff), ("MGG", mass)], layout="bigmat"))
    wide = f"GRID*   {10:16d}{0:16d}{'1.5+2':>16s}{'0.0':>16s}\n*       {'0.0':>16s}\n"
    bulk = written(tmp_path, "a.bdf", f"GRID,20,,100.0,0.,50.\n{wide}CEND\n")
    body = Structure.read(path, path, nodes=bulk, points={"tip": 20}, lines=[(10, 20)], scale=Scale("mm", "t", "s"))
    assert body.labels == tuple((node, name) for node in (10, 20) for name in NAMES)
    np.testing.assert_allclose(body.nodes[20], [0.1, 0.0, 0.05])
    np.testing.assert_allclose(body.nodes[10], [0.15, 0.0, 0.0])
    np.testing.assert_allclose(body.K[0, 1], 1e3 * stiff[0, 1])
    np.testing.assert_allclose(body.M[3, 3], 1e3 * 1e-6 * mass[3, 3])
    with pytest.raises(ValueError, match=r"12 dofs are not six of each of the 1 nodes; give labels=\[\(node, 'x'\),"):
        Structure.read(path, path, nodes={10: (0, 0, 0)})


def test_units_that_look_wrong_are_told(tmp_path):
    """A steel rod of 1 m: 7.85e-3 t over 1000 mm, read as kg and m, and with its scale."""
    lumped, labels = np.diag([3.925e-3] * 2), [(1, "x"), (2, "x")]
    np.savez(tmp_path / "rod.npz", K=2.1e4 * np.array([[1.0, -1.0], [-1.0, 1.0]]), M=lumped, labels=labels)
    read = tmp_path / "rod.npz", tmp_path / "rod.npz"
    nodes = {1: (0.0, 0.0, 0.0), 2: (1000.5, 0.0, 0.0)}
    wrong, right = (Structure.read(*read, nodes=nodes, scale=scale).check() for scale in (None, Scale("mm", "t", "s")))
    assert any("the nodes span 1000.5 m: is it in other units? give scale=" in one for one in wrong)
    assert any("a mass of 0.00785 kg over 1000.5 m: is it in other units?" in one for one in wrong)
    assert not any("units" in one for one in right)


def test_mass_follows_the_order_of_the_stiffness(tmp_path):
    """A mass of other order without the massless dof; a foreign one is refused."""
    massless = M.copy()
    massless[3, 3] = 0.0
    order = [2, 0, 1]
    text = "".join(f"{LABELS[i][0]},{NAMES.index(LABELS[i][1]) + 1},{LABELS[j][0]},{NAMES.index(LABELS[j][1]) + 1},"
                   f"{massless[i, j]}\n" for i in order for j in order if massless[i, j])  # fmt: skip
    stiff, mass = written(tmp_path, "K.mtx", abaqus(K, "input")), written(tmp_path, "M.mtx", text)
    body = Structure.read(stiff, mass)
    np.testing.assert_allclose(body.M.toarray(), massless)
    assert body.massless == [(11, "ry")]
    with pytest.raises(ValueError, match=r"M.mtx, its dofs: expected those of K.mtx, got \(8, 'x'\) beside them"):
        Structure.read(stiff, written(tmp_path, "M.mtx", text + "8,1,8,1,2.0\n"))
    io.mmwrite(tmp_path / "I.mtx", np.eye(3))
    with pytest.raises(ValueError, match=r"I.mtx, its matrix: expected the size of K.mtx, 4 dofs, got 3"):
        Structure.read(stiff, tmp_path / "I.mtx")


def test_one_matrix_is_not_stiffness_and_mass(tmp_path):
    np.savez(tmp_path / "cut.npz", K=K, labels=np.array(LABELS))
    with pytest.raises(ValueError, match=r"cut.npz, as a whole: expected a stiffness and a mass, got K for both"):
        Structure.read(tmp_path / "cut.npz", tmp_path / "cut.npz")


def test_mass_follows_the_labels_given_for_the_stiffness(tmp_path):
    """A mass with dofs of its own beside a stiffness without; and a stiffness whose own dofs contradict the labels."""
    stiffness, own = np.array([[3.0, -1.0], [-1.0, 1.0]]), [(2, "x"), (1, "x")]
    np.save(tmp_path / "K.npy", stiffness)
    np.savez(tmp_path / "M.npz", M=np.diag([2.0, 5.0]), labels=own)
    np.savez(tmp_path / "both.npz", K=stiffness, M=np.diag([2.0, 5.0]), labels=own)
    body = Structure.read(tmp_path / "K.npy", tmp_path / "M.npz", labels=own[::-1])
    assert body.M.diagonal().tolist() == [5.0, 2.0]
    with pytest.raises(ValueError, match=r"M.npz, its dofs: expected those of K.npy, got \(2, 'x'\)"):
        Structure.read(tmp_path / "K.npy", tmp_path / "M.npz", labels=[("a", "x"), ("b", "x")])
    with pytest.raises(ValueError, match=r"its dofs: expected the order of labels, \(1, 'x'\), got \(2, 'x'\) there"):
        Structure.read(tmp_path / "both.npz", tmp_path / "both.npz", labels=own[::-1])
    renamed = Structure.read(tmp_path / "both.npz", tmp_path / "both.npz", labels=[("a", "x"), ("b", "x")])
    assert renamed.labels == (("a", "x"), ("b", "x"))


def test_labels_from_files(tmp_path):
    for name, matrix in (("K", K), ("M", M)):
        io.mmwrite(tmp_path / f"{name}.mtx", matrix)
    files = {
        "a.dof": "".join(f"{node}.{NAMES.index(c) + 1}\n" for node, c in LABELS),
        "a.mapping": MAPPING,
        "a.txt": "# node component\n3 x\n3, 3\n7 y\n11 ry\n",
    }
    for name, text in files.items():
        body = Structure.read(tmp_path / "K.mtx", tmp_path / "M.mtx", labels=written(tmp_path, name, text))
        assert body.labels == LABELS
    with pytest.raises(ValueError, match=r"b.txt, line 2: expected a node and a component, got '3'"):
        Structure.read(tmp_path / "K.mtx", tmp_path / "M.mtx", labels=written(tmp_path, "b.txt", "3 x\n3\n"))


def test_modes_of_a_superelement_are_kept_and_have_no_unit(tmp_path):
    text = dmig([("KAAX", K), ("MAAX", M)]).replace(f"{11:16d}{5:16d}", f"{11:16d}{0:16d}")
    path = written(tmp_path, "km.pch", text)
    body = Structure.read(path, path)
    assert body.components == ("x", "y", "z")
    assert body.rows(11).nnz == 0
    with pytest.raises(ValueError, match=r"a scale needs displacements and rotations, no generalised coordinates"):
        Structure.read(path, path, scale=Scale("mm", "t", "s"))


# --- nodes ------------------------------------------------------------------------------------------------------------


def test_nodes(tmp_path):
    inp = "*HEADING\n** a comment\n*NODE, NSET=ALL\n1, 0.0, 1.0\n2, 2., 0., -1.5E+0\n*ELEMENT, TYPE=B31\n1, 1, 2\n"
    assert read_nodes(written(tmp_path, "a.inp", inp)) == {1: (0.0, 1.0, 0.0), 2: (2.0, 0.0, -1.5)}
    assert read_nodes(written(tmp_path, "a.txt", "# node x y z\n4 1 2 3\n")) == {4: (1.0, 2.0, 3.0)}
    with pytest.raises(ValueError, match=r"line 1: expected GRID 7 in the basic system .*, got .* 0 and 3: turn them"):
        read_nodes(written(tmp_path, "a.bdf", "GRID,7,,1.,2.,3.,3\n"))
    usual = "GRID,7,,1.,2.,3.\nGRDSET,,,,,,4\n"  # of grids that name no systems, before it too
    with pytest.raises(ValueError, match=r"line 1: expected GRID 7 in the basic system .*, got systems 0 and 4"):
        read_nodes(written(tmp_path, "c.bdf", usual))
    assert read_nodes(written(tmp_path, "c.bdf", usual.replace("3.\n", "3.,0\n"))) == {7: (1.0, 2.0, 3.0)}
    with pytest.raises(ValueError, match=r"line 2: expected node, x, y, z, got '5 a b c'"):
        read_nodes(written(tmp_path, "b.txt", "4 1 2 3\n5 a b c\n"))


@pytest.mark.parametrize(
    "grid",
    [
        "GRID*,7,,1.0,2.0\n*,3.0\n",
        "GRID*                  7                             1.0             2.0\n$ z\n*                    3.0\n",
        "GRID           7             1.0     2.0     3.0 $ tip\n",
        "GRID\t7\t\t1.\t2.\t3.\n",
        "SOL 103\nBEGIN BULK\n$\nGRID,7,,1.,2.,3. $ tip\nENDDATA\n",
    ],
)
def test_grids_in_all_fields(tmp_path, grid):
    """Of large fields with commas, or with a comment between their lines, z was 0."""
    assert read_nodes(written(tmp_path, "a.bdf", grid.replace("\n", "\r\n"))) == {7: (1.0, 2.0, 3.0)}


ONE = "*NODE\n1, 1.,0.,0.\n"


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        (
            "a.bdf",
            "INCLUDE 'b.bdf'\nGRID,2,,1.,2.,3.\n",
            "line 1: expected all GRID cards in one file, got INCLUDE 'b.bdf'",
        ),
        ("a.bdf", "GRID,2,,1.,2.,3.\nGRID,2,,1.,2.,4.\n", r"line 2: expected node 2 once, got it at \(1.0, 2.0, 3.0\)"),
        ("a.inp", "*NODE, SYSTEM=C\n1,1.,90.,0.\n", r"got '\*NODE, SYSTEM' in .*line 1"),
        ("a.inp", "*System\n1.,0.,0.\n" + ONE, r"got '\*SYSTEM' in .*line 1"),
        ("a.inp", ONE + "*NGEN\n1,5,1\n", r"got '\*NGEN' in .*line 3"),
        ("a.inp", ONE + "*INSTANCE, NAME=I\n5.,0.,0.\n", "an instance must not be moved, got '5.,0.,0.'"),
        ("a.inp", ONE + "*PART, NAME=B\n*NODE\n1, 2.,0.,0.\n", "line 5: expected node 1 once"),
        ("a.inp", ONE + "*INCLUDE, INPUT=none.inp\n", r"\*INCLUDE must name another file, got '.*none.inp'"),
        ("a.txt", "1 0 0 0\n1 0 0 2\n", "line 2: expected node 1 once"),
    ],
)
def test_nodes_that_would_stand_elsewhere_are_refused(tmp_path, name, text, said):
    with pytest.raises(ValueError, match=said):
        read_nodes(written(tmp_path, name, text))


def test_nodes_of_tables_and_included_files(tmp_path):
    written(tmp_path, "nodes.txt", "** only data\n7, 1.0D+0, 2.,\n")
    text = "*Node, nset=all\n*Include, input=nodes.txt\n*Element, type=B31, input=bars.txt\n*Node print\nU,\n"
    assert read_nodes(written(tmp_path, "a.inp", text)) == {7: (1.0, 2.0, 0.0)}
    assert read_nodes(written(tmp_path, "a.txt", "\ufeff7,1,2,3\ntip;0;0;0\n")) == {7: (1, 2, 3), "tip": (0, 0, 0)}


def test_dmig_with_tabs_and_comments(tmp_path):
    text = "DMIG\tK\t0\t6\t2\t0\nDMIG\tK\t3\t1\t\t3\t1\t5. $ a\n$ b\n\t4\t2\t-1.\nDMIG,K,4,2,,4,2,7. $ c\n"
    check(read_matrices(written(tmp_path, "a.pch", text)), [[5.0, -1.0], [-1.0, 7.0]], ((3, "x"), (4, "y")))


def test_complex_matrices_are_refused(tmp_path):
    """Sparse ones lost their imaginary parts, of dense ones another matrix of the file was read."""
    turned = sparse.coo_matrix(np.asarray(K) * (1.0 + 0.1j))
    np.savez(tmp_path / "dense.npz", K=turned.toarray(), M=M)
    np.savez(tmp_path / "parts.npz", K_data=turned.data, K_row=turned.row, K_col=turned.col)
    np.save(tmp_path / "one.npy", turned.toarray())
    sparse.save_npz(tmp_path / "sparse.npz", turned.tocsr())
    for name in ("dense.npz", "parts.npz", "one.npy", "sparse.npz"):
        with pytest.raises(ValueError, match=rf"{name}, .*: expected real numbers, and damping as C, .*, got complex"):
            read_matrices(tmp_path / name)
    np.savez(tmp_path / "real.npz", K=np.asarray(K) + 0j)
    np.testing.assert_array_equal(read_matrices(tmp_path / "real.npz").matrix("K").toarray(), K)
