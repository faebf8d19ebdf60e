"""A history of energies, momentum and forces of walls, from which momentum and energy can be balanced to round-off."""

from yade import EnergyAccount
from yade.dembark.frames import StepMeans
from yade.dembark.writers import EnergyWriter, _Snapshot


class Balance:
    """Momentum of the grains, and the force of each wall on them: at a step, and its mean over the `every` steps up to it.

    walls : name -> id of a body, or ids
    every : steps of a row of the history, which is 0, every, 2 every ...
    axes : components that are written
    gravity : m/s^2
    glued : wall -> ids of held spheres whose force counts to that wall's
    """

    def __init__(self, walls, every, axes="xz", gravity=(0.0, 0.0, -9.81), glued=None):
        self._snapshot = _Snapshot(walls, glued, gravity, None)
        self._axes = ["xyz".index(axis) for axis in axes]
        self._means, self._now, self._mean = StepMeans(every), [], []
        self.columns = [f"momentum_{axis}" for axis in axes]
        self.columns += [f"{name}_{kind}{axis}" for name in walls for axis in axes for kind in "fm"]

    def add(self):
        """Take the forces of this step; once in every step, between forces and motion, before the row of the step is written."""
        forces = self._snapshot.current().wallForces()
        self._now = [force[k] for force in forces for k in self._axes]
        self._mean = self._means.add(*self._now) or self._mean

    def values(self):
        """Numbers of the columns, at a step that ends a row."""
        momentum = self._snapshot.current().momentum()
        return [*(momentum[k] for k in self._axes), *(x for pair in zip(self._now, self._mean, strict=True) for x in pair)]

    def writer(self, path="time.csv", more=(), more_values=tuple):
        """Writer of a history with all energies of the account but those that LIGGGHTS has not, these columns, and `more` with the values
        that `more_values()` returns."""
        left_out = ("kinetic", "numerical_damping")
        names = EnergyAccount().keys()
        energies = {"kinetic_energy": "kinetic"} | {name: name for name in names if name not in left_out}
        return EnergyWriter(path, energies, more=[*self.columns, *more], more_values=lambda: [*self.values(), *more_values()])

    def save(self):
        """Write what has been added up since the last row into the scene."""
        self._means.save()

    def load(self):
        """Take it from the scene."""
        self._means.load()
