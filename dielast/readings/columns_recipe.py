"""Recipe tables of what was measured: the specimen, by which extension and force become stretch and stress, and which column of
a table is what, and what that says of the measurement.
"""

from collections.abc import Collection, Iterable
from typing import Any, TypeAlias

from pydantic import Field

from dielast.base import units
from dielast.base.errors import InputError
from dielast.material.measurement_kind import KindName
from dielast.recipe.fields import Length, Section
from dielast.recipe.file_fields import ColumnName

GAUGE = 'gauge_length = "80 mm"'
SECTION = 'width = "6 mm", thickness = "0.5 mm"'
STRAINS, STRESSES = ("strain", "stretch", "extension"), ("stress", "force")
"""What one quantity may be measured as: the deformation, and the load."""
OVER_TIME = ("time", "modulus", "strain", "stretch", "stress", "extension", "force", "compliance")
OVER_FREQUENCY = ("frequency", "angular_frequency", "storage", "loss", "tan_delta", "complex_modulus", "complex_viscosity")
MODULI = ({"storage", "loss"}, {"storage", "tan_delta"}, {"complex_modulus", "tan_delta"})
"""The columns from which the two moduli of a sweep can be computed."""
MECHANICAL = ("modulus", "strain", "stress", "compliance", "storage", "loss", "complex_modulus")
"""What differs between tension and shear."""

_Column: TypeAlias = ColumnName | None


def _of(dimension: units.Dimension, description: str) -> Any:
    """The field of a column with numbers of a `dimension`."""
    field: Any = Field(None, description=description)
    field.metadata.append(dimension)
    return field


class Specimen(Section):
    """The undeformed specimen: the length that an extension is divided by, and the cross-section that a force acts on."""

    gauge_length: Length | None = Field(None, description="Undeformed length that the extension is divided by.")
    width: Length | None = Field(None, description="Undeformed width of the cross-section that the force acts on.")
    thickness: Length | None = Field(None, description="Undeformed thickness of the cross-section that the force acts on.")

    def _check(self) -> None:
        if self.width is not None and self.thickness is None:
            raise InputError("width and thickness go together: they are the cross-section that a force acts on")

    @property
    def area(self) -> float | None:
        """Cross-section in m^2, if it is stated."""
        return None if self.width is None or self.thickness is None else self.width * self.thickness


class NamedColumns(Section):
    """Names or numbers of columns, each under the role that the column has."""

    @property
    def by_role(self) -> dict[str, str | int]:
        """The columns that are stated, by their role."""
        return {role: column for role in type(self).model_fields if (column := getattr(self, role)) is not None}


class MachineColumns(NamedColumns):
    """Columns of a table that a testing machine wrote, where they have other names than usual."""

    time: ColumnName | None = Field(None, description='Time. Default: "time".')
    stretch: ColumnName | None = Field(None, description="Stretch; or strain, or extension.")
    strain: ColumnName | None = Field(None, description="Strain, which is stretch - 1.")
    extension: ColumnName | None = Field(None, description="Extension, a length; needs specimen.gauge_length.")
    stress: ColumnName | None = Field(None, description="Nominal stress; or force.")
    force: ColumnName | None = Field(None, description="Force; needs specimen.width and thickness.")


def first_role(roles: Iterable[str], found: Collection[str]) -> str | None:
    """The first of the `roles` that was found."""
    return next((role for role in roles if role in found), None)


def unmeasured(roles: Collection[str], specimen: Specimen | None) -> str | None:
    """What the recipe must state about the `specimen` for extension or force among `roles`, as a message; None if nothing."""
    lacking = [
        (role, what)
        for role, what, known in (
            ("extension", GAUGE, specimen is not None and specimen.gauge_length is not None),
            ("force", SECTION, specimen is not None and specimen.area is not None),
        )
        if role in roles and not known
    ]
    if not lacking:
        return None
    what = " and ".join(f"{'an' if role == 'extension' else 'a'} {role}" for role, _ in lacking)
    verb = "need" if len(lacking) > 1 else "needs"
    return f"{what} {verb} the undeformed specimen: specimen = {{ {', '.join(needed for _, needed in lacking)} }}"


class Columns(NamedColumns):
    """Columns of a relaxation or creep test over time, or of a frequency sweep."""

    temperature: _Column = _of(units.TEMPERATURE, "Temperature, where one file holds several temperatures.")
    set: _Column = Field(
        None,
        description="A label or number that is the same in all rows at one temperature. Default: temperature_tolerance separates "
        "them.",
    )
    time: _Column = _of(units.TIME, 'Time since the start of the test. Default: "time".')
    modulus: _Column = _of(units.STRESS, "Relaxation modulus.")
    strain: _Column = _of(units.STRAIN, "Strain, with stress or force; instead of modulus or compliance.")
    stretch: _Column = _of(units.NUMBER, "Stretch, which is 1 + strain; instead of strain.")
    stress: _Column = _of(units.STRESS, "Nominal stress, with strain, stretch or extension.")
    extension: _Column = _of(units.LENGTH, "Extension, a length, instead of strain; needs specimen.gauge_length.")
    force: _Column = _of(units.FORCE, "Force, instead of stress; needs specimen.width and thickness.")
    compliance: _Column = _of(units.COMPLIANCE, "Creep compliance.")
    frequency: _Column = _of(units.FREQUENCY, "Frequency of a sweep, in Hz.")
    angular_frequency: _Column = _of(units.ANGULAR_FREQUENCY, "Angular frequency of a sweep, in rad/s.")
    storage: _Column = _of(units.STRESS, "Storage modulus, with loss or tan_delta.")
    loss: _Column = _of(units.STRESS, "Loss modulus.")
    tan_delta: _Column = _of(units.NUMBER, "Loss modulus over storage modulus, with storage or complex_modulus.")
    complex_modulus: _Column = _of(units.STRESS, "Magnitude of the complex modulus, with tan_delta.")
    complex_viscosity: _Column = _of(
        units.VISCOSITY, "Magnitude of the complex viscosity, by which the unit of the frequencies, Hz or rad/s, is checked."
    )

    @property
    def measurement(self) -> KindName:
        """The kind of measurement that the columns show; strain and stress mean relaxation unless the recipe says creep."""
        columns = self.by_role
        if any(role in columns for role in OVER_FREQUENCY):
            return "oscillation"
        return "creep" if "compliance" in columns else "relaxation"

    def _check(self) -> None:
        columns = self.by_role
        over_time = [role for role in OVER_TIME if role in columns]
        over_frequency = [role for role in OVER_FREQUENCY if role in columns]
        if over_time and over_frequency:
            raise InputError(
                f"columns of a test over time ({', '.join(over_time)}) and of a frequency sweep ({', '.join(over_frequency)}): "
                "state those of one kind of measurement"
            )
        if over_frequency:
            _check_sweep(columns)
        else:
            _check_over_time(columns)
        first: dict[str | int, str] = {}
        for role, column in columns.items():
            if first.setdefault(column, role) != role:
                raise InputError(f'{first[column]} and {role} are the same column, "{column}"')


ROLES = {role: mark for role, field in Columns.model_fields.items() for mark in field.metadata if isinstance(mark, units.Dimension)}
"""The dimension of the numbers in a column by its role."""


def _check_over_time(columns: Collection[str]) -> None:
    strains, stresses = ([role for role in alike if role in columns] for alike in (STRAINS, STRESSES))
    for alike in (strains, stresses):
        if len(alike) > 1:
            raise InputError(f"{' and '.join(alike)} are the same quantity: one of them is needed")
    stiffness = [role for role in ("modulus", *stresses, "compliance") if role in columns]
    if len(stiffness) > 1:
        raise InputError(f"either modulus, or strain and stress, is needed, or compliance, not {' and '.join(stiffness)}")
    if len(strains) != len(stresses):
        raise InputError("strain (or stretch, or extension) and stress (or force) go together")
    if not stiffness:
        raise InputError(
            "either modulus, or strain and stress, is needed (or extension and force); for creep compliance; "
            "for a sweep storage and loss over frequency or angular_frequency"
        )


def _check_sweep(columns: Collection[str]) -> None:
    measured = [role for role in ("storage", "loss", "tan_delta", "complex_modulus") if role in columns]
    if measured == ["tan_delta"]:
        raise InputError("tan_delta alone gives no modulus: storage or complex_modulus is needed with it")
    if set(measured) not in MODULI:
        ways = "storage and loss, or storage and tan_delta, or complex_modulus and tan_delta"
        raise InputError(f"{ways}, are needed" + (f", not {' and '.join(measured)}" if measured else ""))
    if "frequency" not in columns and "angular_frequency" not in columns:
        raise InputError("frequency (in Hz) or angular_frequency (in rad/s) is needed")
