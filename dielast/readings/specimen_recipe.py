"""Specimens of testing machines, by which extension and force become stretch and stress, and the columns that a machine writes."""

from __future__ import annotations

from collections.abc import Collection

from pydantic import Field, model_validator

from dielast.errors import InputError
from dielast.recipe.fields import ColumnName, Length, Section

GAUGE = 'gauge_length = "80 mm"'
SECTION = 'width = "6 mm", thickness = "0.5 mm"'


class Specimen(Section):
    """The undeformed specimen: what an extension is over, and the section that a force acts on."""

    gauge_length: Length | None = Field(None, description="Undeformed, what an extension is divided by.")
    width: Length | None = Field(None, description="Undeformed, of the section that a force acts on.")
    thickness: Length | None = Field(None, description="Undeformed, of the section that a force acts on.")

    @model_validator(mode="after")
    def _whole_section(self) -> Specimen:
        if self.width is not None and self.thickness is None:
            raise InputError("width and thickness go together: a force acts on the section that they make")
        return self

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

    time: ColumnName | None = Field(None, description='Left out: "time".')
    stretch: ColumnName | None = Field(None, description="Or strain, or extension.")
    strain: ColumnName | None = Field(None, description="The stretch less 1.")
    extension: ColumnName | None = Field(None, description="A length; needs specimen.gauge_length.")
    stress: ColumnName | None = Field(None, description="Nominal; or force.")
    force: ColumnName | None = Field(None, description="Needs specimen.width and thickness.")


def unmeasured(roles: Collection[str], specimen: Specimen | None) -> str | None:
    """The message for what the recipe must state of the `specimen` for extension or force among `roles`; None if nothing lacks."""
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
