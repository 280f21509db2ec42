"""`dielast report`: one page of several results that opens without any other file, in the order in which they were made."""

from __future__ import annotations

import base64
import io
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest
from PIL import Image
from processes import ENDS, Run

from dielast.plots.style import panels, style

EMPTY = {"meta", "img", "br", "hr", "link", "input"}
HOSTILE = '<script>alert("1")</script> & <img src=x onerror=alert(1)>'
PAGE = "report.html"


class Parsed(HTMLParser):
    """A page: its elements with their attributes, its text, and whether every element is closed in turn."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    def all(self, tag: str) -> list[dict[str, str]]:
        return [attributes for name, attributes in self.elements if name == tag]

    @property
    def text(self) -> str:
        return "".join(self.words)


@pytest.fixture(scope="module")
def chain(tmp_path_factory: pytest.TempPathFactory, command: Run) -> Path:
    """A folder with the results curve, spectrum and relax, each made from the one before; two figures are PNG, one SVG."""
    folder = tmp_path_factory.mktemp("chain")
    for kind in ("mastercurve", "spectrum", "relax"):
        (folder / f"{kind}.toml").write_text(command(folder, "new", kind).stdout)
    for arguments in (
        ("mastercurve", "mastercurve.toml", "-o", "out/curve"),
        ("spectrum", "spectrum.toml", "-o", "out/spectrum", "--set", "mastercurve=out/curve"),
        ("relax", "relax.toml", "-o", "out/relax", "--set", "material=out/spectrum/material.toml", "--plot", "svg"),
    ):
        done = command(folder, *arguments, "-q")
        assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def results(chain: Path, tmp_path: Path) -> Path:
    """The folder of the test, with a copy of the chain."""
    shutil.copytree(chain / "out", tmp_path / "out")
    return tmp_path


def test_a_chain_on_one_page(results: Path, dielast: Run) -> None:
    done = dielast("report", "out/relax", "out/curve", "out/spectrum", "out/curve/")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "report: out/curve, out/spectrum, out/relax in report.html\n"
    first = (results / PAGE).read_bytes()
    page = Parsed(first.decode())
    # no link and no resource leads out of the page
    places = {
        name: [a[name] for _, a in page.elements if name in a] for name in ("href", "src", "srcset", "data", "action", "poster")
    }
    assert not any(places[name] for name in ("srcset", "data", "action", "poster"))
    identifiers = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(set(identifiers)) == len(identifiers)
    assert {place[1:] for place in places["href"]} <= set(identifiers)
    assert not {tag for tag, _ in page.elements} & {"script", "link", "iframe", "object"}
    assert "url(" not in first.decode()
    assert "@import" not in first.decode()
    # every figure as it lies in its folder
    figures = [
        (results / name).read_bytes() for name in ("out/curve/mastercurve.png", "out/spectrum/spectrum.png", "out/relax/relax.svg")
    ]
    shown = [place.partition(",") for place in places["src"]]
    assert [base64.b64decode(content) for _, _, content in shown] == figures
    assert [head for head, _, _ in shown] == [*["data:image/png;base64"] * 2, "data:image/svg+xml;base64"]
    assert all(attributes["alt"] for attributes in page.all("img"))
    assert all(attributes.get("scope") in ("col", "row") for attributes in page.all("th"))
    assert page.all("html") == [{"lang": "en"}]
    # the chain, by the contents of files
    links = [attributes["href"] for attributes in page.all("a")]
    assert links == ["#result-1", "#result-2", "#result-3", *["#result-1"] * 2, "#result-2"]
    assert "shift-factors.csv" in page.text
    assert "mastercurve.csv: 20 of 399 rows, all of them in the file" in page.text
    assert "… 379 rows left out …" in page.text
    assert 'mastercurve = "out/curve"' in page.text
    assert "13.67" in page.text
    # the same results, the same bytes, in whatever order they are listed
    dielast("report", "out/spectrum", "out/relax", "out/curve", "-o", "again.html")
    assert (results / "again.html").read_bytes() == first


def test_a_changed_result_is_refused_until_its_summary_says_so(results: Path, dielast: Run) -> None:
    material = results / "out/spectrum/material.toml"
    material.write_text(material.read_text() + "# another\n")
    refused = dielast("report", "out/curve", "out/spectrum", "out/relax")
    assert refused.returncode == 2
    assert refused.stderr == (
        "out/spectrum/summary.toml: material.toml is not the file that its run wrote (changed since, or another run was ended "
        'while it wrote): run it again; where that was on purpose, write changed = ["material.toml"] at the top of this '
        "summary.toml\n"
    )
    assert not (results / PAGE).exists()
    summary = results / "out/spectrum/summary.toml"
    summary.write_text('changed = ["material.toml"]\n' + summary.read_text())
    done = dielast("report", "out/curve", "out/spectrum", "out/relax")
    text = "was made from another material.toml than the one in out/spectrum now: run it again"
    changed, made = done.stderr.splitlines()
    assert changed == "warning: out/spectrum: material.toml was changed after the run, as summary.toml states"
    assert made == f"warning: out/relax: {text}"
    assert done.returncode == 0
    page = Parsed((results / PAGE).read_text("utf-8"))
    assert text in page.text
    assert "relax in out/relax, 1 warning" in page.text


def test_lines_that_a_version_control_ended_otherwise_are_no_change(results: Path, dielast: Run) -> None:
    table = results / "out/relax/relax.csv"
    table.write_bytes(table.read_bytes().replace(b"\n", b"\r\n"))
    done = dielast("report", "out/relax")
    assert (done.returncode, done.stderr) == (0, "")


def test_what_another_run_left_in_the_folder_is_left_out(results: Path, dielast: Run) -> None:
    home = results / "out/relax"
    (results / "relax.toml").write_text(dielast("new", "relax").stdout)
    later = dielast("relax", "relax.toml", "-o", "out/relax", "-q", "--plot", "png", "--set", "temperature='30 degC'")
    assert later.returncode == 0, later.stderr
    (home / "cycles.csv").write_text("case\n1\n")
    done = dielast("report", "out/relax")
    assert done.stderr.splitlines() == [
        "warning: out/relax: relax.svg is left out, as it lacks the mark of the run of summary.toml: run it again, or write "
        'changed = ["relax.svg"] at the top of summary.toml',
        "warning: out/relax: cycles.csv is left out, as the run of summary.toml did not write it",
    ]
    page = Parsed((results / PAGE).read_text("utf-8"))
    (figure,) = page.all("img")
    assert figure["src"].startswith("data:image/png")  # not the SVG of the earlier run
    assert "cycles.csv" not in page.text.replace("cycles.csv is left out", "")
    (home / "relax.png").unlink()
    summary = home / "summary.toml"
    summary.write_text('changed = ["relax.svg"]\n' + summary.read_text())  # the user knows better
    dielast("report", "out/relax")
    (figure,) = Parsed((results / PAGE).read_text("utf-8")).all("img")
    assert figure["src"].startswith("data:image/svg")


def test_figures_hold_the_mark_of_their_run_and_no_date() -> None:
    with style():
        figure, _ = panels(1, None)
    for form, key in (("png", "Source"), ("svg", "Source"), ("pdf", "Keywords")):
        file = io.BytesIO()
        figure.savefig(file, format=form, metadata={key: "mark of a run"})
        assert b"mark of a run" in file.getvalue()
        assert not any(word in file.getvalue() for word in (b"CreationDate", b"dc:date", b"Software", b"Matplotlib v"))


def test_names_and_texts_are_no_markup(results: Path, dielast: Run) -> None:
    home = results / HOSTILE.replace("/", "|")
    (results / "out/relax").rename(home)
    summary = home / "summary.toml"
    text = summary.read_text().replace('recipe = "relax.toml"', f"recipe = '{HOSTILE}'\nwarnings = ['{HOSTILE}', \"bell \\u0007\"]")
    summary.write_text(text.replace("[[inputs]]", f"[more]\n'{HOSTILE}' = '{HOSTILE}'\n\n[[inputs]]", 1))
    for name in ("cases.csv", "cycles.csv"):
        summary.write_text(f'{summary.read_text()}\n[[outputs]]\nfile = "{name}"\nsha256 = ""\n')
    summary.write_text(f'changed = ["cases.csv", "cycles.csv", "relax.svg"]\n{summary.read_text()}')
    (home / "cases.csv").write_text(f'"{HOSTILE.replace(chr(34), chr(34) * 2)}"\n"{HOSTILE.replace(chr(34), chr(34) * 2)}"\n')
    (home / "cycles.csv").write_text("".join(f"column{index}," for index in range(40)) + "last\n" + "1," * 40 + "1\n")
    done = dielast("report", home.name)
    assert done.returncode == 0, done.stderr
    page = Parsed((results / PAGE).read_text("utf-8"))
    assert "script" not in {tag for tag, _ in page.elements}
    assert [set(attributes) for attributes in page.all("img")] == [{"src", "alt"}]
    assert page.text.count(HOSTILE) >= 5
    assert "bell \N{REPLACEMENT CHARACTER}" in page.text
    assert "cycles.csv: 12 of 41 columns, all of them in the file" in page.text


@pytest.mark.parametrize(
    ("arguments", "messages"),
    [
        (("out", "none"), ["out: the folder has no summary.toml: a folder", "none: no such folder: a folder"]),
        (("out/curve/summary.toml",), ["out/curve/summary.toml: is a file: a folder"]),
        (("out/curve", "-o", "map.toml"), ["map.toml: a report is HTML: a name such as report.html is needed"]),
        (("out/curve", "-o", "folder.html"), ["folder.html: is a folder, a file is to be written there"]),
        (("out/curve", "-o", "out/curve/summary.toml/x.html"), ["out/curve/summary.toml: is a file, a folder for the report"]),
        ((), ["dielast report: missing argument 'FOLDER...'"]),
        (("",), ["dielast report: invalid value for 'FOLDER...': is empty"]),
    ],
)
def test_wrong_folders_and_names(results: Path, dielast: Run, arguments: tuple[str, ...], messages: list[str]) -> None:
    (results / "folder.html").mkdir()
    done = dielast("report", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == len(messages)
    assert all(line.startswith(message) for line, message in zip(done.stderr.splitlines(), messages, strict=True))
    assert not (results / PAGE).exists()


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('kind = "relax"', 'kind = "table"', "kind: unknown kind of result"),
        ('kind = "relax"', "kind = 3", "kind: unknown kind of result"),
        ('kind = "relax"', 'kind = "relax"\nwarnings = "one"', "warnings: a list of text is needed"),
        ('kind = "relax"', 'kind = "relax', "line 1: "),
        ("[[inputs]]\nfile =", "[[inputs]]\nname =", "inputs: every entry needs a file and its sha256"),
    ],
)
def test_a_summary_that_was_edited(results: Path, dielast: Run, before: str, after: str, message: str) -> None:
    summary = results / "out/relax/summary.toml"
    summary.write_text(summary.read_text().replace(before, after))
    done = dielast("report", "out/curve", "out/relax")
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2
    assert line.startswith(f"out/relax/summary.toml: {message}")


def test_a_table_that_was_edited(results: Path, dielast: Run) -> None:
    (results / "out/relax/relax.csv").write_text("a,b\n1\n")
    summary = results / "out/relax/summary.toml"
    summary.write_text('changed = ["relax.csv"]\n' + summary.read_text())
    done = dielast("report", "out/relax")
    assert (done.returncode, done.stderr) == (2, "out/relax/relax.csv: not a table that dielast wrote: rows differ in length\n")


def test_copies_of_one_folder_stay_as_they_are_listed(results: Path, dielast: Run) -> None:
    for name in ("a", "b"):
        shutil.copytree(results / "out/spectrum", results / name)
        shutil.copy(results / "out/curve/mastercurve.csv", results / name / "draws.csv")  # what the other one read
    assert dielast("report", "b", "a").stdout == "report: b, a in report.html\n"


def test_a_result_without_a_figure_says_so_and_a_report_is_renewed(results: Path, dielast: Run) -> None:
    assert dielast("report", "out/relax").returncode == 0
    assert "No figure" not in (results / PAGE).read_text("utf-8")
    (results / "out/relax/relax.svg").rename(results / "out/relax/relax.pdf")
    assert dielast("report", "out/relax").returncode == 0
    assert "No figure in PNG or SVG is in the folder." in Parsed((results / PAGE).read_text("utf-8")).text


def picture(color: str) -> bytes:
    buffer = io.BytesIO()
    Image.new("RGB", (400, 200), color).save(buffer, "png")
    return buffer.getvalue()


def test_a_browser_shows_the_figures(results: Path, dielast: Run) -> None:
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if browser is None:
        pytest.skip("no Chromium is installed")
    for name in ("out/curve/mastercurve.png", "out/relax/relax.svg"):
        summary = (results / name).with_name("summary.toml")
        summary.write_text(f'changed = ["{Path(name).name}"]\n{summary.read_text()}')
    (results / "out/curve/mastercurve.png").write_bytes(picture("#ff00ff"))
    (results / "out/relax/relax.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="400" height="200"><rect width="400" height="200" fill="#00ff00"/></svg>'
    )
    assert dielast("report", "out/curve", "out/relax").returncode == 0
    quiet = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--user-data-dir={results / 'profile'}")
    shot = results / "page.png"
    command = [browser, *quiet, "--window-size=900,6000", f"--screenshot={shot}", (results / PAGE).as_uri()]
    subprocess.run(command, capture_output=True, timeout=ENDS, check=True)
    colors = {color: count for count, color in Image.open(shot).convert("RGB").getcolors(1 << 24) or []}
    assert colors[255, 0, 255] >= 400 * 200
    assert colors[0, 255, 0] >= 400 * 200
