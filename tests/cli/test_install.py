"""dielast as a user gets it: an archive and a wheel that need no checkout, and a version that names the commit of one."""

from __future__ import annotations

import shutil
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from pathlib import Path

import pytest
from processes import ENDS
from setuptools import Distribution

from dielast import __version__
from dielast.cli.version import version

TOP = Path(__file__).parents[2]
BUILD = "import setuptools.build_meta as backend; print(backend.build_{}({!r}))"
RECIPE = 'kind = "relax"\nmaterial = "example:vhb4905"\n[[step]]\nstretch = 1.1\nrate = "0.1 /s"\n'


def run(*command: str | Path, folder: Path) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=ENDS, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def checked_out() -> set[str]:
    """The files of the package."""
    files = {path.relative_to(TOP).as_posix() for path in (TOP / "dielast").rglob("*") if path.is_file()}
    return {name for name in files if "__pycache__" not in name}


def built(what: str, source: Path, out: Path) -> Path:
    """The archive or the wheel that setuptools makes of a source folder; pip would make it in an environment of its own."""
    return out / run(sys.executable, "-c", BUILD.format(what, str(out)), folder=source).splitlines()[-1]


def test_a_wheel_will_hold_every_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """What setuptools would copy into it; the test below builds one and installs it."""
    monkeypatch.chdir(TOP)
    distribution = Distribution({"src_root": "", "script_name": "setup.py"})
    distribution.parse_config_files(["pyproject.toml"])
    command = distribution.get_command_obj("build_py")
    command.ensure_finalized()
    data = [f"{folder}/{name}" for _, folder, _, names in command.data_files for name in names]
    assert {Path(name).as_posix() for name in (*command.get_source_files(), *data)} == checked_out()


@pytest.mark.trust
def test_an_archive_becomes_a_wheel_that_runs_without_the_checkout(tmp_path: Path) -> None:
    source = tmp_path / "source"
    left_out = shutil.ignore_patterns("__pycache__", "*.egg-info")
    shutil.copytree(TOP / "dielast", source / "dielast", ignore=left_out)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(TOP / name, source)
    archive = built("sdist", source, tmp_path)
    with tarfile.open(archive) as packed:
        packed.extractall(tmp_path / "unpacked", filter="data")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    shutil.rmtree(source)
    wheel = built("wheel", unpacked, tmp_path)
    # all that the checkout has, and nothing of tests or recipes
    with zipfile.ZipFile(wheel) as packed_wheel:
        names = {name for name in packed_wheel.namelist() if ".dist-info/" not in name}
    assert names == checked_out()

    environment, elsewhere = tmp_path / "environment", tmp_path / "elsewhere"
    run(sys.executable, "-m", "venv", "--without-pip", environment, folder=tmp_path)
    python = environment / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--quiet", wheel, folder=tmp_path)
    # what it depends on comes from the environment of the tests, as a folder alone: no link to the checkout is followed
    site = run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", folder=tmp_path).strip()
    (Path(site) / "dependencies.pth").write_text(f"{sysconfig.get_path('purelib')}\n")
    shutil.rmtree(unpacked)
    elsewhere.mkdir()
    (elsewhere / "r.toml").write_text(RECIPE)
    assert run(python.with_name("dielast"), "--version", folder=elsewhere) == f"dielast {__version__}\n"
    assert site in run(python, "-c", "import dielast; print(dielast.__file__)", folder=elsewhere)
    run(python, "-m", "dielast", "relax", "r.toml", "--plot", "none", folder=elsewhere)
    assert (elsewhere / "r/relax.csv").read_bytes().startswith(b"case,temperature [degC],time [s],stretch_1 [1],")


def test_a_checkout_names_the_commit_that_git_names(tmp_path: Path) -> None:
    if shutil.which("git") is None or not (TOP / ".git").exists():
        pytest.skip("no checkout, or no git to ask")
    head = run("git", "rev-parse", "HEAD", folder=TOP)[:12]
    assert version() == f"dielast {__version__}, checkout of commit {head}"
    # another program's repository, in which dielast is installed; a checkout that git cannot read
    (tmp_path / ".git").mkdir()
    assert version(tmp_path) == f"dielast {__version__}"
    (tmp_path / "pyproject.toml").touch()
    assert version(tmp_path) == f"dielast {__version__}"


def test_the_citation_is_valid_and_of_this_version() -> None:
    """The keys that the Citation File Format 1.2.0 needs, and nothing that it does not know."""
    yaml = pytest.importorskip("yaml")
    citation = yaml.safe_load((TOP / "CITATION.cff").read_text())
    known = {"cff-version", "message", "title", "type", "version", "license", "authors", "keywords", "preferred-citation"}
    assert {"cff-version", "message", "title", "authors"} <= citation.keys() <= known
    assert citation["cff-version"] == "1.2.0"
    assert citation["version"] == __version__
    assert citation["type"] in ("software", "dataset")
    article = citation["preferred-citation"]
    assert {"type", "title", "authors"} <= article.keys()
    assert f"doi   = {{{article['doi']}}}" in (TOP / "README.md").read_text()
    for authors in (citation["authors"], article["authors"]):
        assert authors
        assert all(set(author) == {"name"} and isinstance(author["name"], str) for author in authors)
