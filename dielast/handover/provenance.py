"""What a material file says of where its constants are from: their origins, the range of the tests, the measured window."""

from typing import Annotated, Any

from pydantic import Field

from dielast.base.errors import InputError, and_more, shown, warn
from dielast.io.table import rounded
from dielast.material.material import CalibratedRange, Material, Window, constants_of
from dielast.recipe.fields import Pair, Section, Temperature, Time, first_below

Share = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class CalibratedSection(Section):
    """The range of the tests that the material was fitted to; a simulation outside this range warns."""

    modes: list[str] = Field(min_length=1, description="Modes in which the specimens were stretched.")
    largest_I1: float = Field(ge=3, description="Largest first invariant of the stretches, l1^2 + l2^2 + l3^2.")
    time: Pair[Time] = Field(description="Shortest and longest time.")
    temperature: Pair[Temperature] = Field(description="Lowest and highest temperature.")
    law_spread: Annotated[float, Field(ge=1, allow_inf_nan=False)] | None = Field(
        None,
        description="Largest ratio between laws that these tests cannot tell apart of the voltage of an equibiaxial film. Default: "
        "no other laws were tried.",
    )
    specimen_scatter: Share | None = Field(
        None,
        description="Scatter of the stress of specimens over the stress, as the tests showed it, for [uncertainty] specimens: the "
        "root of its mean square over all correlations of the model's error along a curve that the tests allow. "
        "scatter.specimen_scatter in a summary of calibrate is that with the likeliest correlation. Default: none is known.",
    )
    model_error: Share | None = Field(
        None,
        description="Error of the model along the curves of the tests over the stress, for the same, and likewise a mean over "
        "correlations; scatter.model_error in a summary of calibrate is that with the likeliest correlation. Default: none is "
        "known.",
    )
    scatter_freedom: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = Field(
        None, description="Degrees of freedom of the estimates of both together. Default: they are exact."
    )
    undetermined: list[str] = Field(
        [],
        description="Paths of constants that the tests do not determine. Draws divide their ranges into parts, those of the first "
        "constants first; an interval holds that of the draws in each part.",
    )

    def stated(self) -> CalibratedRange:
        """The range of the tests."""
        (first, last), (coldest, hottest) = self.time, self.temperature
        seen = self.law_spread, self.specimen_scatter, self.model_error, self.scatter_freedom
        return CalibratedRange(
            tuple(self.modes), self.largest_I1, (first, last), (coldest, hottest), *seen, tuple(self.undetermined)
        )


class WindowSection(Section):
    """The part of the relaxation that was measured; a simulation that is slower warns."""

    reduced_time_s: Annotated[Pair[Annotated[float, Field(gt=0, allow_inf_nan=False)]], first_below("the shortest time")] = Field(
        description="Shortest and longest reduced time of the measured curve in s, at the reference temperature."
    )
    plateau_reached: bool = Field(description="Whether the curve had reached the plateau of the equilibrium modulus.")

    def stated(self) -> Window:
        """The part of the relaxation that was measured."""
        first, last = self.reduced_time_s
        return Window((first, last), self.plateau_reached)


ORIGINS = "stated", "measured", "fitted"
SEEN = "law_spread", "specimen_scatter", "model_error", "scatter_freedom"  # what the tests showed beside their range


def origins(value: Any) -> dict[str, str]:
    """The origins by path, of paths in quotes or as tables."""
    if not isinstance(value, dict):
        raise InputError(f"{shown(value)}: a table of constants by path is needed")
    flat = {}
    for path, origin in value.items():
        inner = {f"{path}.{key}": each for key, each in origin.items()} if isinstance(origin, dict) else {path: origin}
        for key, each in inner.items():
            if not isinstance(each, str):
                raise InputError(f'{key}: {shown(each)}: "stated", "measured" or "fitted: " with the tests is needed')
            flat[key] = each
    return flat


def warn_of_origin(material: Material) -> None:
    """Warn of origins (path -> origin) of constants that the material does not have, and of other origins."""
    known = {f"{section}.{key}" for section, group in constants_of(material).items() for key in group}
    known |= {"nonequilibrium.relaxation_time_s", "nonequilibrium.shear_modulus_Pa"}
    unknown = [path for path in material.origin if path.partition("[")[0] not in known]
    if unknown:
        warn(f"origin: the material has no {', '.join(map(shown, unknown[:3]))}{and_more(len(unknown) - 3)}")
    for path, origin in material.origin.items():
        if origin.partition(":")[0] not in ORIGINS:
            warn(f"origin: {shown(path)} = {shown(origin)}: stated, measured or fitted is expected")


OF_SCATTER = (
    "# specimen_scatter, model_error: means over all correlations of the error along a curve that the tests allow;\n"
    "# [scatter] of summary.toml has those with the likeliest correlation\n"
)


def stated_provenance(material: Material) -> dict[str, Any]:
    """The sections of a material file that say where the constants of a material are from."""
    document: dict[str, Any] = {}
    if (calibrated := material.calibrated) is not None:
        document["calibrated"] = {
            "modes": list(calibrated.modes),
            "largest_I1": rounded(calibrated.largest_invariant),
            "time": [f"{value:.9g} s" for value in calibrated.time],
            "temperature": [f"{value:.9g} degC" for value in calibrated.temperature],
            **{key: rounded(value) for key in SEEN if (value := getattr(calibrated, key)) is not None},
            **({"undetermined": list(calibrated.undetermined)} if calibrated.undetermined else {}),
        }
    document |= {"origin": dict(material.origin)} if material.origin else {}
    if (window := material.window) is not None:
        document["window"] = {"reduced_time_s": rounded(list(window.time)), "plateau_reached": window.plateau_reached}
    return document
