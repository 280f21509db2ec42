"""Write validation.md and its figures: measured data of others against dielast. It takes some minutes.

    python recipes/validation --data ../shared/data                    write the page
    python recipes/validation --data DIR --only shifts --compare       print where a section differs from the page, then exit 1

DIR holds polystyrene/ (stressrelaxation_ps*, oscillation_ps* and creep_ps*_data.csv of the pyRheo package) and vhb4905/
(3-creep.csv to 6-coupled.csv of HyperCalibration.jl, its data of Liao et al.). No measured data are part of dielast.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import warnings
from pathlib import Path

for library in ("OPENBLAS", "OMP", "MKL"):  # as the command line does, so that all round alike
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
RECIPES = Path(__file__).resolve().parents[1]
sys.path.insert(1, str(RECIPES))

from claims import differences
from counted import voltage_tests
from coupled import coupled
from gallery import shrink
from intervals import shift_intervals
from polystyrene import other_tests, shifts
from raw import raw_tests
from vhb4905 import halves

from dielast import DielastWarning

SECTIONS = {
    "shifts": shifts,
    "other-tests": other_tests,
    "halves": halves,
    "coupled": coupled,
    "raw-tests": raw_tests,
    "voltage-tests": voltage_tests,
    "intervals": shift_intervals,
}
HEAD = """# Validation on measured data

What dielast makes of measurements that others made and published, and where it fails. `python recipes/validation --data DIR`
writes this page from their files, which are no part of dielast: DIR/polystyrene and DIR/vhb4905, see
`python recipes/validation --help`."""


MARK = "<!-- {} -->\n"


def sections_of(page: str) -> dict[str, str]:
    """The sections of a page by their names, which stand above them as comments."""
    _, *parts = re.split(r"^<!-- (\S+) -->\n", page, flags=re.MULTILINE)
    return {name: text.strip() for name, text in zip(parts[::2], parts[1::2], strict=True)}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, metavar="DIR")
    parser.add_argument("--only", action="append", choices=SECTIONS, help="only this section; repeatable")
    parser.add_argument("--compare", action="store_true", help="compare with the page instead of writing it")
    options = parser.parse_args()
    page = RECIPES / "validation.md"
    texts = sections_of(page.read_text(encoding="utf-8")) if page.is_file() else {}
    made = {}
    for name in options.only or SECTIONS:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DielastWarning)
            made[name] = SECTIONS[name](options.data)
    now = {name: section.text.strip() for name, section in made.items()}
    if options.compare:
        lines = [f"{name}: {line}" for name, text in now.items() for line in differences(text, texts.get(name, ""))]
        sys.stdout.buffer.write("".join(f"{line}\n" for line in lines).encode())
        return 1 if lines else 0
    texts |= now
    parts = [HEAD, *(MARK.format(name) + texts[name] for name in SECTIONS if name in texts)]
    page.write_text("\n\n".join(parts) + "\n", encoding="utf-8", newline="\n")
    figures = {name: figure for section in made.values() for name, figure in section.figures.items()}
    for name, figure in figures.items():
        picture = RECIPES / "gallery" / f"validation-{name}.png"
        figure.savefig(picture)
        shrink(picture, picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
