"""Specimens, by which extension and force become stretch and stress, and the columns of a testing machine's table."""

from collections.abc import Collection

from pydantic import Field

from dielast.errors import InputError
from dielast.recipe.fields import Length, Section
from dielast.recipe.file_fields import ColumnName

GAUGE = 'gauge_length = "80 mm"'
SECTION = 'width = "6 mm", thickness = "0.5 mm"'


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
