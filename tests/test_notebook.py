"""A notebook run without a browser: figures, tables, a bar, and no words that nobody asked for."""

import pytest

nbformat = pytest.importorskip("nbformat", reason="the extra notebook is not installed")
nbclient = pytest.importorskip("nbclient", reason="the extra notebook is not installed")
pytest.importorskip("ipykernel", reason="the extra notebook is not installed")

SCENE = """
import fembeam as fb
from contacts import Hertz
beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
stops, drive, damping = [fb.Stop(0.5, Hertz(1e9))], fb.Harmonic(1e-3, 150.0), fb.ModalDamping(0.05)
model = fb.Scene(beam, [fb.Clamped(0.0)], stops=stops, base=drive, damping=damping).reduce(modes=2)
model"""
CELLS = {
    "model": SCENE,
    "bar": "run = model.simulate(0.3, 1e-3, progress=True)",
    "run": "run",
    "orbit": "model.orbit()",
    "figure": "figure = fb.plot.mode_shapes(model)\nfigure",
    "again": "figure",
    "shown": "figure.show()",
    "left": "import matplotlib.pyplot as plt\nprint(plt.get_fignums())",
    "with magic words": "%matplotlib inline\nfigure",
    "without widgets": """
import sys
sys.modules["ipywidgets"] = None
for name in [name for name in sys.modules if name.startswith("tqdm")]:
    del sys.modules[name]
run = model.simulate(0.3, 1e-3, progress=True)""",
}


@pytest.fixture(scope="module")
def outputs():
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code) for code in CELLS.values()])
    nbclient.NotebookClient(book, timeout=600, kernel_name="python3").execute()
    return dict(zip(CELLS, [cell.outputs for cell in book.cells], strict=True))


def kinds(shown):
    """Kinds of data of a cell's outputs."""
    return [kind for output in shown for kind in output.get("data", {})]


@pytest.mark.parametrize("name", ["model", "run", "orbit"])
def test_results_are_tables(outputs, name):
    (shown,) = outputs[name]
    assert "<table>" in shown.data["text/html"]


@pytest.mark.parametrize("name", ["figure", "again", "shown", "with magic words"])
def test_a_figure_is_one_picture(outputs, name):
    assert kinds(outputs[name]).count("image/png") == 1
    assert not [output for output in outputs[name] if output.output_type == "stream"]


def test_pyplot_keeps_nothing(outputs):
    assert outputs["left"][0].text.strip() == "[]"


def test_progress_is_shown(outputs):
    (shown,) = outputs["bar"]
    bars = {"application/vnd.jupyter.widget-view+json"} & set(kinds([shown]))
    assert bars or "s simulated" in shown.get("text", "")


def test_without_widgets_the_bar_is_text_and_nothing_is_warned_of(outputs):
    text = "".join(output.text for output in outputs["without widgets"])
    assert "100%" in text
    assert "0.3/0.3 s simulated" in text
    assert "Warning" not in text
