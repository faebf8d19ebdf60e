"""Coarse-grained fields of systems with known fields: totals, crystals, shear and rotation; and independence of the threads."""

from __future__ import annotations

import numpy as np

from dembark.postproc import ContactFrame, GrainFrame
from dembark.postproc.fields.accumulators import MASS, STRESS, FieldSums
from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.grid import Grid
from dembark.postproc.fields.kernels import NAMES, Kernel, cumulative, line_nodes

from . import scenes
from .item import Array, Curve, Item, Panel, exact, order

GOLDHIRSCH = "Goldhirsch 2010"


def conservation() -> Item:
    """Totals of the fields against the sums over the grains, for kernels from a fifth of a cell to wider than the system."""
    network = scenes.heap()
    random = np.random.default_rng(5)
    velocities = random.normal(size=network.frame.positions.shape)
    frame = scenes.grains(network.frame.positions, network.frame.radii, velocities, low=np.zeros(3), high=np.ones(3))
    mass, momentum = frame.masses.sum(), (frame.masses[:, None] * frame.velocities).sum(axis=0)
    carried = np.einsum("ma,mb->ab", network.links.forces, -network.links.branch)
    products = np.abs(network.links.forces[:, :, None] * network.links.branch[:, None, :])
    scales = mass, (frame.masses[:, None] * np.abs(frame.velocities)).sum(axis=0).max(), products.sum(axis=0).max()
    widths = np.array([0.02, 0.1, 0.5])
    errors = {kernel: np.array([_totals(frame, network, kernel, width, (mass, momentum, carried), scales) for width in widths])
              for kernel in NAMES}
    worst = np.max([found.max(axis=0) for found in errors.values()], axis=0)
    return Item(
        "conservation",
        "Conservation of mass, momentum and stress",
        f"The totals of {len(frame.ids)} grains of different sizes and {len(network.links.ids)} contacts must be those of the cells, to "
        "round-off, for each kernel and for any width relative to the cells (0.15 of the size of the system).",
        [exact("mass_error", "mass: Σ ρ V / Σ m − 1, the worst kernel and width", worst[0], GOLDHIRSCH, "a grain without its mass"),
         exact("momentum_error", "momentum: |Σ ρ v V − Σ m v|, over Σ m |v|", worst[1], GOLDHIRSCH, "a grain without its mass"),
         exact("stress_error", "contact stress: |Σ σ V + Σ f l|, over Σ |f l|", worst[2], GOLDHIRSCH, "a lost contact")],
        [Panel(title, "width (system = 1)", "error / round-off of a double", [
            Curve(kernel, widths, np.maximum(found[:, column] / np.finfo(float).eps, 1e-1)) for kernel, found in errors.items()])
         for column, title in enumerate(("Mass", "Momentum", "Contact stress"))],
        "Errors in units of the spacing of double-precision numbers at 1 (2.2·10⁻¹⁶); those below a tenth of it are drawn at 0.1.",
    )


def _totals(frame: GrainFrame, network: scenes.Network, kernel: str, width: float, due: tuple[Array | float, ...],
            scales: tuple[float, ...]) -> list[float]:
    margin = Kernel(kernel, width).reach
    count = int(np.ceil((1.0 + 2.0 * margin) / 0.15))
    grid = Grid(np.full(3, -margin), np.full(3, 0.15 * count - margin), (count,) * 3)
    fields = coarse_grain(frame, network.links, grid, kernel=kernel, width=width).fields()
    assert fields.contact_stress is not None
    sums = (values.sum(axis=(0, 1, 2)) * grid.cell_volume for values in (fields.density, fields.momentum, fields.contact_stress))
    return [float(np.abs(found - known).max() / scale) for found, known, scale in zip(sums, due, scales, strict=True)]


def threads() -> Item:
    """The same system on different numbers of threads."""
    network = scenes.heap()
    grid = Grid(np.full(3, -0.4), np.full(3, 1.4), (18,) * 3)

    def summed(count: int) -> FieldSums:
        return coarse_grain(network.frame, network.links, grid, width=0.12, walls=[network.base], threads=count)

    one, parts = summed(1), ("grains", "contacts", "boundary")
    assert one.contacts is not None
    found = one.grains[..., MASS], one.contacts[..., STRESS], one.boundary
    different = sum(int((getattr(one, name) != getattr(other, name)).sum()) for other in map(summed, (2, 3, 7)) for name in parts)
    gap = max(float(np.abs(part - plain).max() / np.abs(plain).max())
              for part, plain in zip(found, _plain(network, grid, 0.12), strict=True))
    return Item(
        "threads",
        "Independence of the number of threads",
        "The compiled coarse graining on 1, 2, 3 and 7 threads, bit for bit, and against sums of mass, stress and force of "
        "the base in numpy, which share no compiled code with it.",
        [exact("thread_differences", "sums that differ in any bit on 2, 3 or 7 threads from those on 1", different,
               "same order of additions", "threads that skip a grain", tolerance=0.0),
         exact("backend_difference", "compiled against numpy: largest difference over the largest sum", gap, "two implementations",
               "a grain without its mass")],
    )


def _plain(network: scenes.Network, grid: Grid, width: float) -> tuple[Array, Array, Array]:
    """Sums of mass, of stress times volume and of the base's force in each cell, by the definitions."""
    kernel, frame, links, base = Kernel("gaussian", width), network.frame, network.links, network.base

    def shares(places: Array) -> Array:
        return np.einsum("na,nb,nc->nabc", *(np.diff(cumulative(kernel, grid.edges(axis) - places[:, [axis]])) for axis in range(3)))

    stress = np.zeros((*grid.shape, 9))
    for first, branch, forces in ((links.first, links.branch, links.forces), (base.positions, base.points - base.positions, base.forces)):
        moment = -(forces[:, :, None] * branch[:, None, :]).reshape(-1, 9)
        for place, weight in zip(*line_nodes(kernel, float(np.linalg.norm(branch, axis=1).max())), strict=True):
            stress += weight * np.tensordot(shares(first + place * branch), moment, (0, 0))
    return np.tensordot(shares(frame.wrapped), frame.masses, (0, 0)), stress, np.tensordot(shares(base.points), base.forces, (0, 0))


def lattice() -> Item:
    """A crystal under pressure: the exact mean, and the ripple by the transform of the kernel."""
    frame, links = scenes.lattice(2, 1.0)
    pressure = 2.0 * np.sqrt(2.0)  # f / d^2, of 12 neighbours at the distance d
    edge = np.sqrt(2.0)
    widths = np.array([0.3, 0.4, 0.5, 0.6, 0.8])
    ripple: dict[str, list[float]] = {"gaussian": [], "lucy": []}
    mean_error = 0.0
    for kernel, errors in ripple.items():
        # The ball of Lucy's kernel is soon as wide as the crystal.
        for width in widths if kernel == "gaussian" else widths[:2]:
            # Kernels of the same second moment, so that they smooth alike.
            scaled = width * np.sqrt(1.0 / (Kernel(kernel, 1.0).variance))
            stress = _periodic(frame, links, kernel, scaled)
            mean = stress.mean(axis=(0, 1, 2))
            mean_error = max(mean_error, float(np.abs(mean / pressure - np.eye(3)).max()))
            errors.append(float(np.abs(np.trace(stress, axis1=-2, axis2=-1) / (3.0 * pressure) - 1.0).max()))
    wave = 2.0 * np.pi * np.sqrt(3.0) / edge
    due = np.exp(-0.5 * (wave * widths) ** 2)
    seen = due > 1e-4
    return Item(
        "lattice",
        "Crystal under pressure",
        "A periodic face-centred cubic crystal whose neighbours at the distance d repel each other with the force f is under the "
        "pressure 2√2 f/d². The mean of the field must equal it to round-off, isotropic and without shear. The single contacts "
        "leave a ripple, which a Gaussian of width w damps by exp(−k² w²/2), where k = 2π√3/a is the wave number of the longest wave.",
        [exact("lattice_pressure", "mean stress over 2√2 f/d², − unit tensor, the worst component", mean_error,
               "sum over the 12 neighbours", "a lost contact")],
        [Panel("Ripple of the pressure against the width", "standard deviation of the kernel / d", "largest |p / p̄ − 1|", [
            *(Curve(kernel, widths[: len(found)], np.array(found)) for kernel, found in ripple.items()),
            Curve("∝ exp(−k² w²/2)", widths[seen], ripple["gaussian"][0] * (due / due[0])[seen], theory=True)], linear=True)],
        "Kernels of the same second moment. The Gaussian follows its transform down to about 10⁻³, the effect of its cut at three widths.",
    )


def _periodic(frame: GrainFrame, links: ContactFrame, kernel: str, width: float, cells: int = 10) -> Array:
    grid = Grid(frame.low, frame.high, (cells,) * 3, (True,) * 3)
    stress = coarse_grain(frame, links, grid, kernel=kernel, width=width).fields().contact_stress
    assert stress is not None
    return stress


def shear() -> Item:
    """Uniform shear and rotation of random grains exactly, a shear wave to second order in the width."""
    network = scenes.heap()
    place, radii = network.frame.positions, network.frame.radii
    gradient = np.array([[0.1, 1.0, -0.4], [0.3, -0.2, 0.6], [0.0, 0.5, 0.1]])
    spin = np.array([0.3, -0.7, 0.2])
    grid = Grid(np.zeros(3), np.ones(3), (8,) * 3)
    sheared = coarse_grain(scenes.grains(place, radii, place @ gradient.T, low=np.zeros(3), high=np.ones(3)), None, grid, width=0.15)
    turning = coarse_grain(scenes.grains(place, radii, np.cross(spin, place), low=np.zeros(3), high=np.ones(3)), None, grid,
                           width=0.15).fields()
    one = sheared.fields(shear_corrected=True)
    widths = np.array([0.03, 0.042, 0.06])
    errors = np.array([_wave_error(width) for width in widths])
    return Item(
        "shear",
        "Shear, rotation and granular temperature",
        "Grains of different sizes at random positions with the velocities of a uniform gradient must give this gradient in every cell, "
        "those of a rigid rotation no strain rate and twice the spin as vorticity; variation of the mean flow within a kernel must not "
        "count as temperature. A wave v = sin(2π y) is smoothed by the kernel, an error of second order in its width.",
        [exact("gradient_error", "uniform gradient: largest error of any component, over the largest",
               _worst(one.velocity_gradient - gradient),
               "affine velocity field", "grains that jitter", tolerance=1e-9,
               detail="round-off, amplified by fitting a gradient to few grains"),
         exact("rotation_error", "rigid rotation: largest strain rate, and error of the vorticity, over the spin",
               max(_worst(turning.strain_rate), _worst(turning.vorticity - 2.0 * spin)) / float(np.linalg.norm(spin)), "rigid rotation",
               "grains that jitter", tolerance=1e-9),
         exact("shear_temperature", "uniform gradient: temperature over that of the velocities within the width of the kernel",
               _worst(one.temperature) / (0.15**2 * float((gradient**2).sum())), "no fluctuations", "grains that jitter",
               tolerance=1e-9),
         order("wave_order", "shear wave: exponent of the width in the error", widths, errors, 2.0, "second moment of the kernel",
               "velocities a hundredth too large")],
        [Panel("Shear wave", "width / wavelength", "largest error of ∂v/∂y / 2π", [
            Curve("gaussian", widths, errors), Curve("slope 2", widths, errors[0] * (widths / widths[0]) ** 2, theory=True)])],
        "A row of 80 grains per wavelength; the error is the largest over all cells.",
    )


def _worst(values: Array) -> float:
    return float(np.nanmax(np.abs(values)))


def _wave_error(width: float) -> float:
    """Largest error of dv/dy over 2 pi for v = sin(2 pi y) carried by a fine lattice of grains."""
    count = 80
    across = (np.arange(count) + 0.5) / count
    place = np.stack(np.meshgrid([0.05], across, [0.05], indexing="ij"), axis=-1).reshape(-1, 3)
    velocity = np.column_stack([np.sin(2.0 * np.pi * place[:, 1]), np.zeros((len(place), 2))])
    frame = scenes.grains(place, np.full(len(place), 0.01), velocity, low=np.zeros(3), high=np.array([0.1, 1.0, 0.1]), periodic=True)
    grid = Grid(frame.low, frame.high, (1, count, 1), (True,) * 3)
    found = coarse_grain(frame, None, grid, width=width).fields().velocity_gradient[0, :, 0, 0, 1]
    return float(np.abs(found / (2.0 * np.pi) - np.cos(2.0 * np.pi * grid.centres(1))).max())
