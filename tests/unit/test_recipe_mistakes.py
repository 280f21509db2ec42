"""All mistakes of a recipe are told at once, each once, in its order and in TOML's own spelling."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st
from pydantic import BaseModel, Field, ValidationError

from dielast.base.errors import InputError, quoted, shown, shown_path
from dielast.commands.registry import COMMANDS, read_cases
from dielast.handover.material_file import read_material
from dielast.recipe.cases import check_load
from dielast.recipe.fields import Section
from dielast.recipe.paths import read_path, read_setting
from dielast.recipe.validate import _PLAIN, _models, check
from dielast.report.summary import print_summary
from dielast.simulate.quantities import ELECTRICAL, FILMS

HEAD = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n'
STEP = '[[step]]\nstretch = 2.0\nrate = "12.5 %/s"\n'
WRONG = """
kind = "relax"
temprature = "20 degC"
output = { noise = -1, times = ["1 s", "2 kg"] }
material = "gone.toml"
"""
COMPARE = '[[compare]]\nfile = "gone.csv"\nx = "time [s]"\ny = "foo"\n'
TOLD = [
    'temprature: unknown key; did you mean "temperature"?',
    "output.noise: -1: at least 0 is needed",
    'output.times[1]: "2 kg": a time is needed, such as "1.5 h"',
    'material: "gone.toml": no such file',
]
NO_COLUMN = 'compare[0].y: "foo" is no column of the result; there are time [s], stretch_1 [1], '


def mistakes(folder: Path, text: str, *overrides: str) -> list[str]:
    path = folder / "r.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_cases(path, None, overrides)
    return [line.removeprefix(f"{path}: ") for line in caught.value.messages]


def test_a_missing_load_file_hides_nothing(tmp_path: Path) -> None:
    *told, last = mistakes(tmp_path, WRONG + 'load = "h.toml"\n' + COMPARE)
    assert told == [*TOLD, 'load: "h.toml": no such file', 'compare[0].file: "gone.csv": no such file']
    assert last.startswith(NO_COLUMN)


def test_nor_do_mistakes_in_a_load_file(tmp_path: Path) -> None:
    (tmp_path / "h.toml").write_text('[[step]]\nstretch = -2.0\nraet = "1 /s"\n')
    *told, first, second = mistakes(tmp_path, WRONG + 'load = "h.toml"\n[sweep]\n"step.0.rate" = ["4 kg"]\n')
    assert told == TOLD
    assert (first, second) == (
        "h.toml: step[0].stretch: -2.0: a number above 0 is needed",
        'h.toml: step[0].raet: unknown key; did you mean "rate"?',
    )


def test_nor_does_a_load_file_beside_steps(tmp_path: Path) -> None:
    text = HEAD + 'load = "h.toml"\n' + STEP.replace("2.0", "-2")
    assert mistakes(tmp_path, text) == [
        "either [[step]] or load is needed, not both",
        "step[0].stretch: -2: a number above 0 is needed",
    ]


def test_nor_do_lists_of_a_sweep_that_are_none(tmp_path: Path) -> None:
    sweep = '[sweep]\n"step.0.rate" = 3\ntemperature = []\nsweep = [1]\n"a..b" = [1]\n"step.0.stretch" = [2.0, -1.0]\n'
    assert mistakes(tmp_path, WRONG + STEP + sweep) == [
        *TOLD,
        'step[0].stretch: -1.0: a number above 0 is needed (from sweep."step.0.stretch")',
        'sweep."step.0.rate": a list of values is needed',
        'sweep."temperature": a list of values is needed',
        'sweep."sweep": a sweep cannot be swept',
        'sweep."a..b": the path of a key is needed, such as "step.0.rate"',
    ]


def test_nor_does_how_a_sweep_combines(tmp_path: Path) -> None:
    sweep = '[sweep]\nmode = "zip"\ntemperature = ["20 degC", "3 kg"]\n"step.0.rate" = ["1 /s", "2 /s", "3 /s"]\n'
    paired = 'sweep: mode = "zip" needs lists of equal length; these have 2, 3 values'
    wrong = 'temperature: "3 kg": a temperature is needed, such as "20 degC" (from sweep."temperature")'
    assert mistakes(tmp_path, HEAD + STEP + sweep) == [paired, wrong]
    other = 'sweep.mode: "product": "zip" is needed, or leave it out for every combination'
    assert other in mistakes(tmp_path, WRONG + STEP + sweep.replace("zip", "product"))
    many = '"solver.rtol" = [' + "1, " * 1000 + "]\ntemperature = [" + "20, " * 1000 + "]\n"
    told = mistakes(tmp_path, HEAD + STEP + "[sweep]\n" + many)
    assert "sweep: 1000000 cases: at most 100000 are allowed" in told
    assert len(told) == 3


def test_what_a_wrong_list_would_have_set_is_not_missed(tmp_path: Path) -> None:
    text = 'kind = "actuate"\n[[step]]\nrate = "1 kV/s"\n[film]\n'
    sweep = '[sweep]\nmaterial = "x.toml"\n"film.thickness" = "1 mm"\n"step.0.voltage" = 3\n'
    told = mistakes(tmp_path, text + sweep)
    assert told == [f'sweep."{key}": a list of values is needed' for key in ("material", "film.thickness", "step.0.voltage")]


def test_every_key_of_a_sweep_is_told(tmp_path: Path) -> None:
    keys = '"step.0.rat" = ["1 /s"]\n"film.thickness" = ["1 mm"]\n"step.0.rate" = ["1 /s", "4 kg"]\n"step.7.rate" = ["1 /s"]\n'
    rate, rat, seven, film = mistakes(tmp_path, HEAD + STEP + "[sweep]\n" + keys)
    assert rat == 'step[0].rat: unknown key; did you mean "rate"? (from sweep."step.0.rat")'
    assert rate == 'step[0].rate: "4 kg": a strain rate is needed, such as "12.5 %/s" (from sweep."step.0.rate")'
    assert seven == 'sweep."step.7.rate": step has one entry, step.0'
    assert film == 'film: unknown key; film belongs to actuate, failure-map, lifetime, design (from sweep."film.thickness")'


def test_only_what_a_sweep_brings_is_said_to_be_of_it(tmp_path: Path) -> None:
    sweep = '[sweep]\n"film.thickness" = ["1 mm"]\n"solver.rtol" = [1e-5]\n"step[0].stretch" = [2, "3"]\n'
    film = 'film = { thickness = "1 kg" }\n'
    assert mistakes(tmp_path, HEAD.replace("relax", "creep") + film + '[solver]\nrtl = 1\n[[step]]\nforce = "1 N"\n' + sweep) == [
        "film: unknown key; film belongs to actuate, failure-map, lifetime, design",
        'solver.rtl: unknown key; did you mean "rtol"?',
        'step[0].stretch: unknown key; stretch belongs to relax, actuate (from sweep."step.0.stretch")',
    ]


def test_a_key_of_another_table_is_not_only_taken_for_one_of_a_similar_name(tmp_path: Path) -> None:
    belongs = "specimen belongs at the top of the recipe, above its tables or in [[compare]]"
    assert mistakes(tmp_path, HEAD + STEP + "[uncertainty]\ndraws = 9\nspecimen = 1\n") == [
        f'uncertainty.specimen: unknown key; did you mean "specimens"? {belongs}'
    ]


def test_a_path_with_brackets_is_the_same_path(tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(HEAD + STEP + '[sweep]\n"step[0].stretch" = [2, 3]\n')
    cases = read_cases(tmp_path / "r.toml", None, ["step[0].rate=1 /s"])
    assert [(case.settings, case.recipe.step[0].rate) for case in cases] == [({"step.0.stretch": n}, 1.0) for n in (2, 3)]
    twice = '[sweep]\n"step[0].stretch" = [2, 3]\n"step.0.stretch" = [2]\n'
    assert mistakes(tmp_path, HEAD + STEP + twice) == ['sweep."step.0.stretch": step.0.stretch is swept twice']
    assert (read_path("a[1][2].b"), read_path('"a[1]".b'), read_path("[0].b")) == (
        ("a", "1", "2", "b"),
        ("a[1]", "b"),
        ("[0]", "b"),
    )


def test_a_table_is_no_recipe_and_no_load_file(tmp_path: Path) -> None:
    path = tmp_path / "hist.csv"
    path.write_text("time [s],stretch\n0,1\n")
    (told,) = mistakes(tmp_path, HEAD + 'load = "hist.csv"\n')
    assert told.endswith('key/value pair; a table of points goes into [[step]]: table = "hist.csv"')
    for read, hint in ((read_cases, "tables are named in a recipe"), (read_material, "a material file is needed")):
        with pytest.raises(InputError, match=f"hist.csv: line 1: not TOML: .*; {hint}"):
            read(path)


def test_all_that_is_wrong_with_a_load_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "h.toml").write_text('title = "x"\n' + STEP.replace("12.5 %/s", "3 kg"))
    assert mistakes(tmp_path, HEAD + 'load = "h.toml"\n') == [
        "h.toml: a load file must hold [[step]] and no other key",
        'h.toml: step[0].rate: "3 kg": a strain rate is needed, such as "12.5 %/s"',
    ]


def test_columns_and_rates_are_told_before_anything_is_solved(tmp_path: Path) -> None:
    steps = '[[step]]\nstretch = 2.0\nrate = "0 /s"\n[[step]]\nhold = "1 s"\n[[step]]\nstretch = 1.0\nrate = "2 /s"\n'
    zero, away, gone, column = mistakes(tmp_path, HEAD + steps + COMPARE)
    assert zero == "step[0]: rate 0 never reaches the target"
    assert away == "step[2]: rate 2 leads away from the target: -1 of stretch is to go, so the rate must be negative"
    assert gone == 'compare[0].file: "gone.csv": no such file'
    assert column.startswith(NO_COLUMN)
    (plot,) = mistakes(tmp_path, HEAD + STEP + '[plot]\nx = "voltage [V]"\n')
    assert plot.startswith('plot.x: "voltage [V]" is no column of the result; there are ')


def test_rates_of_loads_and_voltages(tmp_path: Path) -> None:
    creep = HEAD.replace("relax", "creep") + 'specimen = { width = "1 mm", thickness = "1 mm" }\n'
    steps = [("force", "2 N", "1 N/s"), ("force", "1 N", "1 N/s"), ("stress", "9 Pa", "-1 Pa/s"), ("stress", "0 Pa", "1 Pa/s")]
    told = mistakes(tmp_path, creep + "".join(f'[[step]]\n{key} = "{value}"\nrate = "{rate}"\n' for key, value, rate in steps))
    assert told == [  # what stress a force makes is left to the solver
        "step[1]: rate 1 N/s leads away from the force: -1 N are to go, so the rate must be negative",
        "step[3]: rate 1 Pa/s leads away from the stress: -9 Pa are to go, so the rate must be negative",
    ]
    wave = '[[step]]\nwaveform = "sine"\nhigh = "3 kV"\nperiod = "1 s"\n[[step]]\nvoltage = "1 kV"\nrate = "-1 V/s"\n'
    film = HEAD.replace("relax", "actuate") + 'film = { thickness = "1 mm" }\n'
    assert mistakes(tmp_path, film + wave + wave.split("\n", 4)[4] * 2 + wave.replace("-1 V", "0 V")) == [
        "step[5]: rate 0 never reaches the voltage"
    ]
    rising = '[[step]]\nvoltage = "1 kV"\nrate = "-1 V/s"\n'
    away = "step[0]: rate -1 V/s leads away from the voltage: +1000 V are to go, so the rate must be positive"
    assert mistakes(tmp_path, film + rising) == [away]
    (tmp_path / "h.toml").write_text(rising)
    assert mistakes(tmp_path, film + 'load = "h.toml"\n') == [f"h.toml: {away}"]
    with pytest.raises(InputError, match="leads away"):
        check_load(COMMANDS, tmp_path / "h.toml")


@pytest.mark.parametrize("kind", ["relax", "creep", "actuate"])
def test_the_columns_of_the_recipes_are_those_of_the_results(kind: str, tmp_path: Path) -> None:
    golden = Path(__file__).parents[1] / "golden"
    headers = {
        header
        for path in golden.glob(f"{kind}-*/**/{kind}.csv")
        for header in path.read_text().split("\n", 1)[0].split(",")
        if header not in ("case", "temperature [degC]")
    }
    rest = 'film = { thickness = "1 mm" }\n' if kind == "actuate" else ""
    told = mistakes(tmp_path, HEAD.replace("relax", kind) + rest + '[[step]]\nhold = "1 s"\n[plot]\ny = "foo"\n')
    known = set(told[0].split("there are ")[1].split(", "))
    assert headers
    on_request = {quantity.header for quantity in FILMS if ELECTRICAL in quantity.needs or not quantity.written}
    on_request |= {"damage [1]"}
    assert known - headers == (on_request if kind == "actuate" else set())
    assert headers <= known


@pytest.mark.parametrize(
    ("text", "overrides", "message"),
    [
        (
            HEAD,
            ["step.0.stretch=3"],
            "step: there is no entry 0 yet: write [[step]] into the recipe, or state the whole list, as in ",
        ),
        (HEAD + '[sweep]\n"step.0.rate" = ["1 /s", "2 /s"]\n', [], "step: there is no entry 0 yet: write [[step]] into the recipe"),
        (HEAD + 'load = "h.toml"\n', ["step.0.stretch=3"], 'step: the steps are in "h.toml": change them there, or sweep them'),
        (HEAD + "[step]\nstretch = 2\n", [], "step: { stretch = 2 }: a list is needed: write [[step]], in double brackets"),
        (
            HEAD + STEP,
            ["sweep.step.0.rate=['1 /s']"],
            'sweep."step": a list of values is needed; write the path in quotes: "step.0.rate"',
        ),
        (HEAD + STEP, ['sweep."step.0.rate"=3'], 'sweep."step.0.rate": a list of values is needed'),
        (HEAD + STEP, ['sweep."step.0.rate=3'], '--set sweep."step.0.rate=3: PATH=VALUE is needed, such as fit.branches=20'),
        (HEAD + STEP, ["output.times.1.'a b'=3"], 'output.times: { 1 = { "a b" = 3 } }: a list is needed'),
        (HEAD + STEP, ["title=x", 'title."x y".z=3'], '--set title."x y".z=3: title is not a table'),
        (
            HEAD + STEP,
            ['compare=[{file="r.toml", x="time [s]", y="time [s]", where={"a b"=[1]}}]'],
            'compare[0].where."a b": [1]: text',
        ),
        (HEAD + STEP, ['output."a b"=3'], 'output."a b": unknown key'),
        (
            HEAD + STEP,
            ['temperature=[true, { a = 1, "b c" = "x" }]'],
            'temperature: [true, { a = 1, "b c" = "x" }]: a temperature is',
        ),
        (HEAD + STEP, ["kind=['a']"], 'kind: ["a"]: one of'),
    ],
)
def test_paths_and_values_are_spelled_as_in_toml(tmp_path: Path, text: str, overrides: list[str], message: str) -> None:
    (line,) = mistakes(tmp_path, text, *overrides)
    assert line.startswith(message)


def test_all_wrong_overrides_are_told(tmp_path: Path) -> None:
    assert mistakes(tmp_path, HEAD + STEP, "a", "title=b", "step.1.rate=3") == [
        "--set a: PATH=VALUE is needed, such as fit.branches=20",
        "--set step.1.rate=3: step has one entry, step.0",
    ]
    wrong = 'temperature: 20: a temperature is needed with its unit, such as "20 degC"'
    assert mistakes(tmp_path, HEAD + "temperature = 20\n" + STEP, "a")[1:] == [wrong]
    assert mistakes(tmp_path, HEAD.replace("relax", "relx"), "a")[1:] == ['kind: "relx": did you mean "relax"?']


def test_one_key_of_a_sweep_can_be_set(tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(HEAD + STEP + '[sweep]\ntemperature = ["20 degC", "30 degC"]\n')
    cases = read_cases(tmp_path / "r.toml", "relax", ['sweep."step.0.stretch"=[2, 3]', "sweep . 'solver.rtol' = [1e-5]"])
    assert [case.settings for case in cases] == [
        {"temperature": temperature, "step.0.stretch": stretch, "solver.rtol": 1e-5}
        for temperature in ("20 degC", "30 degC")
        for stretch in (2, 3)
    ]


def test_a_swept_path_may_have_quotes_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(HEAD + STEP + """[sweep]\n'output."points_per_decade"' = [3, 4]\n""")
    assert [case.recipe.output.points_per_decade for case in read_cases(tmp_path / "r.toml")] == [3, 4]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("a", '"a"'),
        (True, "true"),
        (2.5, "2.5"),
        (["1 s", False, 2], '["1 s", false, 2]'),
        ((1, 2), "[1, 2]"),
        ({"a": 1, "b c": {}}, '{ a = 1, "b c" = {} }'),
        ([1000] * 5000, "[" + "1000, " * 9 + "10..."),
        ({"a\nb": "c\nd"}, r'{ "a\nb" = "c\nd" }'),
    ],
)
def test_values_are_shown_as_toml_has_them(value: Any, text: str) -> None:
    assert shown(value) == text


def test_what_is_nested_without_end_is_cut() -> None:
    value: Any = 1
    for _ in range(100_000):
        value = [value]
    assert shown(value) == "[" * 9 + "..." + "]" * 9


KEY = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=5)


@given(st.lists(KEY, min_size=1, max_size=4), st.text(max_size=5))
def test_a_path_is_read_as_it_is_shown(keys: list[str], value: str) -> None:
    path = shown_path(keys)
    assert read_path(path) == tuple(keys)
    assert read_setting(f"{path}={value}") == (tuple(keys), value.strip())


@given(st.text("ab.=\"'\\ \n", max_size=12))
def test_any_path_is_read_or_none(text: str) -> None:
    path = read_path(text)
    assert path is None or all(isinstance(key, str) for key in path)
    assert quoted(text)[0] in "\"'"


ODD: list[Any] = [
    *(True, 3, 2.5, "x", "", -1, 1e9, 10**12, float("nan"), float("inf")),
    *([], [1], [[]], ["1 s"], ["1 s", "2 s", "3 s"], [1, 2, 3], {}, {"a": 1}, {"a": [1]}, {"a": {}}),
]


def models_within(model: type[BaseModel], found: set[type[BaseModel]]) -> set[type[BaseModel]]:
    if model not in found:
        found.add(model)
        for field in model.model_fields.values():
            for inner in _models(field.annotation):
                models_within(inner, found)
    return found


@pytest.mark.parametrize("kind", COMMANDS)
def test_every_kind_of_mistake_has_words_of_its_own(kind: str, tmp_path: Path) -> None:
    for model in models_within(COMMANDS[kind].model, set()):
        for name, field in model.model_fields.items():
            for value in ODD:
                try:
                    model.model_validate({field.alias or name: value}, context={"folder": tmp_path})
                except ValidationError as error:
                    types = {problem["type"] for problem in error.errors()} - {"value_error", "extra_forbidden"}
                    assert types <= _PLAIN.keys(), (model, name, value)


class Named(Section):
    """Of a name."""

    name: str = Field(min_length=3)


def test_characters_are_counted_too(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='name: "a": at least 3 characters are needed'):
        check(Named, {"name": "a"}, "r.toml", tmp_path)


def test_a_list_of_one_is_a_list(capsys: pytest.CaptureFixture[str]) -> None:
    breakdown = {"cases": [0], "time_s": [646.522147], "nothing": []}
    print_summary({"kind": "actuate", "breakdown": breakdown, "actuate": {"cases": 1}}, Path())
    assert capsys.readouterr().out == "breakdown.cases = [0]\nbreakdown.time_s = [646.52]\nactuate.cases = 1\n"
