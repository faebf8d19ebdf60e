"""What decks of vibrated machines write: the columns of the energy account, and the grains that touch a part."""

from yade import EnergyAccount
from yade.dembark.writers import DumpWriter, EnergyWriter

# LIGGGHTS has no numerical damping; rolling resistance is off in these decks.
_LEFT_OUT = ("kinetic", "numerical_damping", "rolling_elastic", "rolling_viscous", "rolling_stored")


def account_history(more, more_values):
    """EnergyWriter of time.csv: energies of the scene's EnergyAccount by the names of the LIGGGHTS decks, then the columns `more` with what
    `more_values()` returns."""
    names = EnergyAccount().keys()
    columns = {"kinetic_energy": "kinetic"} | {name: name for name in names if name not in _LEFT_OUT}
    return EnergyWriter("time.csv", columns, more, more_values)


class TouchWriter(DumpWriter):
    """Appends frames of the grains that the wall `name`, made of the bodies `ids`, pushes to touches.dump; `bounds` and `more` as for
    DumpWriter."""

    def __init__(self, name, ids, bounds, **more):
        super().__init__({name: ids}, bounds, grains="touches.dump", contacts=None, **more)

    def _chosen(self, rows):
        # The wall's force stands last.
        return "".join(row for row in rows.splitlines(keepends=True) if any(float(x) for x in row.split()[-3:]))
