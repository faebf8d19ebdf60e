"""Single contact in YADE: the same spheres, planes and measurements as liggghts.in. What is measured and why: README.md.

By hand, in an empty folder: yade -n -x yade.py [key=value ...]
Keys, defaults and units (SI) are those of case.toml beside this file.
"""

import math
import sys
from pathlib import Path

from yade import dembark

p = dembark.parameters(Path(sys.argv[0]).resolve().with_name("case.toml"))

# --- derived quantities; liggghts.in has the same formulas -------------------------------------------------------------
O.dt = p.time_step
stride = math.ceil(p.duration / p.time_step / (p.frames - 1))
steps = stride * (p.frames - 1)
lead = p.lead_steps * p.time_step
spacing = 4 * p.radius * max(1.0, p.size_ratio)
stiffer, denser, larger = p.stiffness_ratio, p.density_ratio, p.size_ratio


def material(youngs_modulus: float, poisson_ratio: float, density: float) -> int:
    return O.materials.append(FrictMat(young=youngs_modulus, poisson=poisson_ratio, density=density))


def body(place: tuple, radius: float, velocity: tuple, spin: float, of: int, mask: int) -> None:
    """A sphere that meets those of its own mask only."""
    sphere = utils.sphere(place, radius, material=O.materials[of], mask=mask)
    sphere.state.vel = velocity
    sphere.state.angVel = (spin, 0, 0)
    O.bodies.append(sphere)


# Body number 1 ... points are of A, then those of B, then the partners in the same order.
rebound, partners = [], []
for m, (youngs_modulus, poisson_ratio, density) in enumerate((
        (p.youngs_modulus_a, p.poisson_ratio_a, p.density_a), (p.youngs_modulus_b, p.poisson_ratio_b, p.density_b))):
    other = material(youngs_modulus * stiffer, poisson_ratio, density * (denser if p.partner == "rest" else 1.0))
    for k in range(p.points):
        value = p.sweep_from + (p.sweep_to - p.sweep_from) * k / max(p.points - 1, 1)
        angle = math.radians(value) if p.sweep in ("direction", "slide", "spin") else 0.0
        # One material a restitution coefficient.
        if k == 0 or p.sweep == "restitution":
            own = material(youngs_modulus, poisson_ratio, density)
            rebound.append((own, other, value if p.sweep == "restitution" else p.restitution))
        normal = p.speed * math.cos(angle) if p.sweep == "direction" else p.speed
        slide = p.speed * {"direction": math.sin(angle), "slide": math.tan(angle)}.get(p.sweep, 0.0)
        spin = p.speed * math.tan(angle) / p.radius if p.sweep == "spin" else 0.0
        site = m * p.points + k
        body((site * spacing, 0, p.radius + normal * lead), p.radius, (0, slide, -normal), spin, own, 1 << m)
        if p.partner == "mirror":
            partners.append(((site * spacing, 0, -(p.radius + normal * lead)), p.radius, (0, -slide, normal), -spin, other, 1 << m))
        elif p.partner == "rest":
            partners.append(((site * spacing, 0, -p.radius * larger), p.radius * larger, (0, 0, 0), 0.0, other, 1 << m))
    if p.partner == "plane":
        O.bodies.append(utils.wall((0, 0, 0), axis=2, sense=1, material=O.materials[other], mask=1 << m))
for partner in partners:
    body(*partner)

far = 2 * p.points * spacing


def write() -> None:
    """Append a frame to grains.dump and a row to time.csv, with all digits; velocities are those of the time of the positions."""
    rows, energy = [], 0.0
    for one in O.bodies:
        if not isinstance(one.shape, Sphere):
            continue
        state, force, torque = one.state, O.forces.f(one.id), O.forces.t(one.id)
        velocity, spin = state.vel + 0.5 * O.dt * force / state.mass, state.angVel + 0.5 * O.dt * torque / state.inertia[0]
        energy += 0.5 * state.mass * velocity.squaredNorm()
        values = (*state.pos, 0, 0, 0, *velocity, *spin, *force, one.shape.radius, state.mass)
        rows.append(f"{len(rows) + 1} 1 " + " ".join(f"{value:.15g}" for value in values) + "\n")
    with open("grains.dump", "a" if O.iter else "w", encoding="ascii") as file:
        file.write(f"ITEM: TIMESTEP\n{O.iter}\nITEM: NUMBER OF ATOMS\n{len(rows)}\nITEM: BOX BOUNDS ff ff ff\n")
        file.write(f"{-spacing} {far}\n{-far} {far}\n{-far} {far}\n")
        file.write("ITEM: ATOMS id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass\n")
        file.writelines(rows)
    with open("time.csv", "a" if O.iter else "w", encoding="ascii") as file:
        file.write(f"{O.iter},{O.time:.15g},{energy:.15g}\n" if O.iter else "step,time,kinetic_energy\n")
    if O.iter % (10 * stride) == 0:
        print(O.iter, f"{O.time:.6g}", f"{energy:.6g}", flush=True)


O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=0.1 * p.radius),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(
            restitution=MatchMaker(matches=rebound), staticFriction=p.friction, kineticFriction=p.friction, criticalSlipDistance=0)],
        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz()],
    ),
    # Between forces and motion, where positions and forces belong to the same time.
    PyRunner(command="write()", iterPeriod=stride, initRun=True),
    NewtonIntegrator(damping=0),
]

dembark.announce(steps)
dembark.run(steps)
