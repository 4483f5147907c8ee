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
    "reactions": "run.reactions()",
    "table": "run.to_dataframe(places=[0.5], quantities=['stress', 'reactions']).abs().max()",
    "data set": "run.to_xarray()",
    "short": """
import solvers
shown = [model, run, run.contacts, run.energy, run.transitions, run.cost, run.reactions(), run.reactions()[0],
         run.extremes(), run.floor_spectrum(0.25, [50.0]), model.frequency_response([50.0], 'base', 0.5), model.system,
         fb.psd(run.displacement(0.5), 1e-3), fb.moments(run.displacement(0.5)), drive, damping, beam, *stops]
print(max(len(repr(one)) for one in shown), sorted(set(solvers.__all__) - set(dir(solvers))))""",
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


@pytest.mark.parametrize("name", ["model", "run", "orbit", "reactions"])
def test_results_are_tables(outputs, name):
    (shown,) = outputs[name]
    assert "<table>" in shown.data["text/html"]


def test_every_object_shows_on_a_few_lines_and_completes(outputs):
    length, missing = outputs["short"][-1].text.strip().split(" ", 1)
    assert int(length) < 600
    assert missing == "[]"


def test_tables_of_pandas_and_xarray_show_themselves(outputs):
    pytest.importorskip("pandas", reason="the extra notebook is not installed")
    pytest.importorskip("xarray", reason="the extra notebook is not installed")
    assert "stress at 0.5 m [N/m²]" in outputs["table"][0].data["text/plain"]
    assert "displacement" in outputs["data set"][0].data["text/html"]


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
