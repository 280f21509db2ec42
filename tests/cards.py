"""What a material card says, read by parsers that know nothing but each code's own conventions."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Read:
    """What a card says: G(t, T) with T on the model's scale, K or None, density or None, and its elastic law."""

    shear: Callable[[NDArray[np.float64], float], NDArray[np.float64]]
    bulk: float | None
    density: float | None
    law: tuple[str, tuple[float, ...]]


def decays(time: NDArray[np.float64], tau: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.exp(-time[:, None] / tau)


def read_abaqus(files: dict[str, str]) -> Read:
    blocks: list[tuple[str, dict[str, str], list[list[float]]]] = []
    for line in files["material.inp"].splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            keyword, *given = [part.strip().upper() for part in line.split(",")]
            blocks.append((keyword, {part.partition("=")[0]: part.partition("=")[2] for part in given}, []))
        else:
            blocks[-1][2].append([float(entry) for entry in line.split(",") if entry.strip()])
    options = {keyword: given for keyword, given, _ in blocks}
    data = {keyword: rows for keyword, _, rows in blocks}
    constants = data["*HYPERELASTIC"][0]
    yeoh = "YEOH" in options["*HYPERELASTIC"]
    g, k, tau = np.array(data["*VISCOELASTIC"]).T
    assert not k.any()
    assert options["*VISCOELASTIC"]["TIME"] == "PRONY"
    long_term = {"LONG TERM": True, "INSTANTANEOUS": False}[options["*HYPERELASTIC"]["MODULI"]]
    stated = 2 * constants[0]
    instantaneous = stated / (1 - g.sum()) if long_term else stated
    shift = options.get("*TRS", {}).get("DEFINITION")

    def shear(time: NDArray[np.float64], at: float) -> NDArray[np.float64]:
        A = 1.0
        if shift == "WLF":
            reference, C1, C2 = data["*TRS"][0]
            A = 10 ** (-C1 * (at - reference) / (C2 + at - reference))
        elif shift == "ARRHENIUS":
            reference, energy = data["*TRS"][0]
            zero = float(options["*PHYSICAL CONSTANTS"]["ABSOLUTE ZERO"])
            gas = float(options["*PHYSICAL CONSTANTS"]["UNIVERSAL GAS CONSTANT"])
            A = math.exp(energy / gas * (1 / (at - zero) - 1 / (reference - zero)))
        return np.asarray(instantaneous * (1 - (1 - decays(time / A, tau)) @ g))

    D1 = constants[3 if yeoh else 1]
    density = data["*DENSITY"][0][0] if "*DENSITY" in data else None
    assert (shift == "ARRHENIUS") == ("*PHYSICAL CONSTANTS" in data)
    assert not shift or list(data).index("*TRS") > list(data).index("*VISCOELASTIC") > list(data).index("*MATERIAL")
    return Read(shear, 2 / D1 if D1 else None, density, ("yeoh" if yeoh else "neo-hookean", tuple(constants)))


def read_ansys(files: dict[str, str]) -> Read:
    tables: dict[str, tuple[list[str], list[float]]] = {}
    density = None
    for line in files["material.mac"].splitlines():
        command, *given = line.partition("!")[0].strip().split(",")
        if command == "TB":
            tables[given[0]] = (given, [])
            active = tables[given[0]][1]
        elif command == "TBDATA":
            assert int(given[0]) == len(active) + 1
            assert len(given) <= 7
            active += [float(value) for value in given[1:]]
        elif command == "MP":
            density = float(given[2])
    hyper, constants = tables["HYPER"]
    prony, pairs = tables["PRONY"]
    assert prony[4] == "SHEAR"
    assert len(pairs) == 2 * int(prony[3])
    alpha, tau = np.array(pairs[::2]), np.array(pairs[1::2])
    law = {"NEO": "neo-hookean", "GENT": "gent", "YEOH": "yeoh"}[hyper[4]]
    instantaneous = 2 * constants[0] if law == "yeoh" else constants[0]
    d = constants[{"neo-hookean": 1, "gent": 2, "yeoh": 3}[law]]

    def shear(time: NDArray[np.float64], at: float) -> NDArray[np.float64]:
        A = 1.0
        if "SHIFT" in tables:
            kind, given = tables["SHIFT"][0][4], tables["SHIFT"][1]
            if kind == "WLF":
                A = 10 ** (given[1] * (at - given[0]) / (given[2] + at - given[0]))
            else:
                assert kind == "TN"
                A = math.exp(given[1] * (1 / given[0] - 1 / at))
        return np.asarray(instantaneous * (1 - alpha.sum() + decays(A * time, tau) @ alpha))

    return Read(shear, 2 / d if d else None, density, (law, tuple(constants)))


def read_febio(files: dict[str, str]) -> Read:
    material = ElementTree.fromstring(files["material.feb"]).find("Material/material")
    assert material is not None
    assert material.get("type") == "uncoupled viscoelastic"
    value = {entry.tag: float(entry.text) for entry in material if entry.tag != "elastic" and entry.text}
    elastic = material.find("elastic")
    assert elastic is not None
    constants = {entry.tag: float(entry.text) for entry in elastic if entry.text}
    modulus = constants["G"] if elastic.get("type") == "Gent" else 2 * (constants["c1"] + constants["c2"])
    terms = [index for index in range(1, 7) if f"g{index}" in value]
    g, tau = (np.array([value[f"{key}{index}"] for index in terms]) for key in "gt")
    assert not any(key.startswith("g7") for key in value)

    def shear(time: NDArray[np.float64], _: float) -> NDArray[np.float64]:
        return np.asarray(modulus * (value.get("g0", 1.0) + decays(time, tau) @ g))

    return Read(shear, value["k"], value.get("density"), (str(elastic.get("type")), tuple(constants.values())))


def read_comsol(files: dict[str, str]) -> Read:
    parameters = {}
    for line in files["material-comsol-parameters.txt"].splitlines():
        match = re.fullmatch(r'(\w+) ([-+.\deE]+)(?:\[(.+)\])? "(.*)"', line)
        assert match, line
        parameters[match[1]] = float(match[2])
    number, factor, tau = np.array(
        [[float(x) for x in row.split(" ")] for row in files["material-comsol-branches-energy-factor.txt"].splitlines()]
    ).T
    _, modulus, same_tau = np.array(
        [[float(x) for x in row.split(" ")] for row in files["material-comsol-branches-shear-modulus.txt"].splitlines()]
    ).T
    assert number.tolist() == list(range(1, len(number) + 1))
    assert np.array_equal(tau, same_tau)
    np.testing.assert_allclose(parameters["mu_eq"] * factor, modulus, rtol=1e-12)
    shift = files.get("material-comsol-shift.txt")

    def shear(time: NDArray[np.float64], at: float) -> NDArray[np.float64]:
        reference = parameters["T_ref"]
        a = 1.0
        if "C1_WLF" in parameters:
            a = 10 ** (-parameters["C1_WLF"] * (at - reference) / (parameters["C2_WLF"] + at - reference))
        elif "Q_arrhenius" in parameters:
            a = math.exp(parameters["Q_arrhenius"] / 8.314462618 * (1 / at - 1 / reference))
        elif shift:
            a = 10 ** float(np.interp(at, *np.array([[float(x) for x in row.split(" ")] for row in shift.splitlines()]).T))
        return np.asarray(parameters["mu_eq"] * (1 + decays(time / a, tau) @ factor))

    law = "gent" if "J_m" in parameters else "yeoh" if "c3" in parameters else "neo-hookean"
    return Read(
        shear, parameters.get("kappa"), parameters.get("rho"), (law, tuple(parameters.get(key, 0.0) for key in ("c1", "c2", "c3")))
    )


def cpp_numbers(text: str, name: str) -> NDArray[np.float64]:
    match = re.search(rf"const real {name}(?:\[\w+\])? = (?:{{([^}}]*)}}|([^;]*));", text)
    assert match, name
    return np.array([float(value) for value in (match[1] or match[2]).split(",")])


def read_mfront(files: dict[str, str]) -> Read:
    text = files["material.mfront"]
    mu_eq, mu, tau = cpp_numbers(text, "mu_eq"), cpp_numbers(text, "mu"), cpp_numbers(text, "tau")
    assert f"@IntegerConstant Nv = {len(mu)};" in text
    assert len(mu) == len(tau)
    law = re.search(r"  // shift factor.*\n((?:.*\n)*?)  // invariants", text)
    assert law

    def shear(time: NDArray[np.float64], at: float) -> NDArray[np.float64]:
        known: dict[str, Any] = {"T": at, "dT": 0.0, "np": np, "Ts": None}
        if "Ts[" in law[1]:
            a = 10 ** float(np.interp(at, cpp_numbers(text, "Ts"), cpp_numbers(text, "log10_a")))
        else:
            for name, expression in re.findall(r"const real (\w+) = (.*);", law[1]):
                known[name] = eval(expression.replace("std::", "np.").replace("np.pow", "pow"), known)
            a = known["a"]
        return np.asarray(mu_eq + decays(time / a, tau) @ mu)

    return Read(shear, float(cpp_numbers(text, "bulk")[0]), None, ("gent", (float(cpp_numbers(text, "inverse_limit_eq")[0]),)))


READERS = {"abaqus": read_abaqus, "ansys": read_ansys, "febio": read_febio, "comsol": read_comsol, "mfront": read_mfront}
