"""The page of a result folder: units of the figures beside the tables, sensible digits, sentences that wrap."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from problems import paper_scene

import fembeam as fb
from contacts import Hertz
from fembeam.results import files
from fembeam.results import html_page as html


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of a run of 20 s, and a study's text with a long sentence."""
    scene = paper_scene(fb.BandNoise(2.5e-4, (0.0, 1226.6), seed=1), 0.05, masses=())
    place = tmp_path_factory.mktemp("results")
    files.write(scene.reduce(2).simulate(20.0, 1e-3), place, discard=1.0)
    (place / "study.txt").write_text("modes  value\n1      0.5\n\n" + "IN DOUBT: " + "many words " * 30 + "\n")
    html.write_page(place)
    return place


def cells(text, head):
    """Numbers of a row of a table as text."""
    row = re.search(rf"<tr><td>{re.escape(head)}</td>(.*?)</tr>", text)[1]
    return re.findall(r"<td>(.*?)</td>", row)


def test_a_heading_that_begins_with_spaces_stands_over_its_table():
    table = "                mean ± standard error\nδ std       0.0029 ± 3.8e-05"
    assert list(html._text(f"6 realisations\n{table}")) == ["<p>6 realisations</p>", f"<pre>{table}</pre>"]


def test_tables_have_the_units_of_the_figures_and_few_digits(folder):
    text = (folder / "report.html").read_text(encoding="utf-8")
    found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    moments, (stop,) = found["moments"].values(), found["contacts"]
    for head, key in (("mean / mm", "mean"), ("std / mm", "std"), ("max / mm", "max")):
        exact = [1e3 * row[key] for row in moments]
        assert [float(cell) for cell in cells(text, head)] == pytest.approx(exact, rel=5e-4), head
    assert all(len(cell.strip("-").replace(".", "").lstrip("0")) == 4 for cell in cells(text, "std / mm"))
    errors = [f"{1e3 * row['std_error']:.1e}" for row in moments]
    assert [f"{float(cell):.1e}" for cell in cells(text, "± s.e.")] in (errors, [f"{stop['rate_error']:.1e}"])
    (time,) = cells(text, "mean time / ms")
    assert float(time) == pytest.approx(1e3 * stop["duration"]["mean"], rel=5e-4)
    assert cells(text, "at z / mm") == ["244.45"]
    assert cells(text, "number") == [str(stop["number"])]
    (stored,) = cells(text, "stored")
    value, unit = stored.split()
    assert float(value) * {"mJ": 1e-3, "µJ": 1e-6, "J": 1.0}[unit] == pytest.approx(found["energy"]["stored"], rel=5e-4)


def test_headings_tell_what_is_of_the_whole_run(folder):
    """Statistics begin after what is discarded; the energy balance and the history do not."""
    text = (folder / "report.html").read_text(encoding="utf-8")
    for heading in ("Response after 1 s", "Contacts after 1 s", "Energy of the whole run"):
        assert f"<h2>{heading}</h2>" in text
    for name in ("Power spectral densities after 1 s", "Densities after 1 s", "Contacts after 1 s",
                 "Time history, an excerpt of the whole run"):  # fmt: skip
        assert f"<figcaption>{name}</figcaption>" in text
    found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert files.text(found).count("after 1 s") == 2
    assert "after" not in files.text(found | {"discarded_seconds": 0.0})


def test_a_stop_has_one_name_in_tables_and_figures(folder):
    """Files keep a key that other places leave as it is."""
    found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    name = found["contacts"][0]["name"]
    assert found["moments"]["indentation, stop 0"]["label"] == f"indentation, {name}"
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert f"indentation, {name}" in files.text(found)
    assert f"<th>indentation, {name}</th>" in page
    assert "stop 0" not in files.text(found) + page
    run = fb.load(folder / "run.npz")
    assert f"contacts of {name} shaded" in fb.plot.time_history(run).get_suptitle().replace("\n", " ")


def test_what_standard_errors_of_one_realisation_are_is_told(folder):
    """In 100 seeds of 60 s they were 3.3 times the scatter in linear motion, 1.5 times with the stop."""
    found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert "Under noise they are upper bounds" in found["confidence"]


def test_why_there_are_no_standard_errors_is_told():
    """It was "too short, or the structure has no damping" of a damped beam and an impactor, too."""

    def said(scene, duration=2.0):
        return files.summary(scene.reduce(2).simulate(duration, 1e-2), discard=0.5)["confidence"]

    damped = paper_scene()
    short = re.search(
        r"the 1\.5 s behind discard are shorter than 4 independent parts; simulate at least (.*) s", said(damped)
    )
    assert said(damped, 1.001 * float(short[1])).startswith("Standard errors")
    assert "mode 2 has no damping, so" in said(replace(damped, damping=fb.ModalDamping((0.02, 0.0))))
    striker = fb.Impactor(0.1, mass=0.01, law=Hertz(1e8), velocity=-0.01, gap=1.0)
    assert "impactor 1 has no damping, so" in said(replace(damped, impactors=[striker]))


def test_sentences_wrap_and_tables_keep_their_lines(folder):
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "<pre>modes  value\n1      0.5</pre>" in text
    assert "<p>IN DOUBT: many words" in text


@pytest.mark.parametrize("value", [1.0, -9.9996, 0.00099999, 12345.6, 99999.9, 3.2e7, 4.5e-8, 1e-30, 123.0])
def test_rounded_numbers_keep_four_digits(value):
    mantissa, _, power = html._rounded(value).partition("·10")
    exponent = int(power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")) or 0)
    assert float(mantissa) * 10.0**exponent == pytest.approx(value, rel=5.01e-4)
    assert exponent % 3 == 0
    assert len(mantissa.strip("-").replace(".", "").lstrip("0")) in (4, 5)
    if abs(value) > 1e-12:
        assert 1.0 <= abs(float(html.with_prefix(value, "J").split()[0])) < 1000.0


def test_numbers_that_are_not_finite_stay_words():
    assert (html._rounded(np.inf), html._rounded(np.nan), html.with_prefix(np.nan, "J")) == ("inf", "nan", "nan J")
