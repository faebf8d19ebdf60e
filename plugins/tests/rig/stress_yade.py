"""Runs random scenes inside YADE: `yade -n -x stress_yade.py scenes.json out.npz`. System Python; numpy only."""

import builtins
import json
import math
import sys

import numpy as np
from yade import utils

FLOOR = 0.1  # m, half of its side


def sphere(grain, material, density):
    body = utils.sphere(Vector3(*grain["position"]), grain["radius"], material=material)
    body.state.vel = Vector3(*grain["velocity"])
    resize(body, grain["radius"], density)
    return body


def resize(body, radius, density):
    body.shape.radius = radius
    body.state.mass = density * 4.0 / 3.0 * math.pi * radius**3
    body.state.inertia = Vector3(1, 1, 1) * 0.4 * body.state.mass * radius**2


def floor_of(kind, material):
    """Bodies of the floor, and how grains meet it."""
    if kind == "plane":
        return [utils.wall(0.0, axis=2, material=material)], None, Ig2_Wall_Sphere_ScGeom()
    joint = FacetSurface()
    a, b, c, d = ((x, y, 0.0) for x, y in ((-FLOOR, -FLOOR), (FLOOR, -FLOOR), (FLOOR, FLOOR), (-FLOOR, FLOOR)))
    return [utils.facet(three, material=material) for three in ((a, b, c), (a, c, d))], joint, Ig2_FacetSurface_Sphere_ScGeom(surface=joint)


def laws_of(case):
    """Words of the functor that makes contacts."""
    m, liquid = case["law"], case["scene"]["liquid"]
    laws = dict(restitution=m["restitution"], staticFriction=m["static_friction"], kineticFriction=m["kinetic_friction"],
                criticalSlipDistance=m["critical_slip_distance"])
    if m["rolling_resistance"] != "off":
        laws.update(rollingFriction=m["rolling_friction"], rollingDampingRatio=m["rolling_damping_ratio"])
    if liquid != "dry":
        laws.update(contactAngle=m["contact_angle"], surfaceTension=m["surface_tension"])
    return laws | (dict(bridgeVolume=m["bridge_volume"]) if liquid == "bridges" else {})


class Run:
    """A scene from its beginning to its end, and its frames."""

    def __init__(self, case):
        O.reset()
        self.case, self.scene, self.rows = case, case["scene"], []
        m = case["law"]
        self.material = O.materials.append(FrictMat(young=m["youngs_modulus"], poisson=m["poisson_ratio"], density=case["density"]))
        floor, joint, meets_floor = floor_of(self.scene["floor"], self.material)
        walls = [O.bodies.append(body) for body in floor]
        self.account = EnergyAccount()
        self.liquid = CapillaryLiquid(content=case["content"]) if self.scene["liquid"] == "carried" else None
        self.shaker = WallMotion(ids=walls, motion=self.scene["motion"]) if self.scene["motion"] else None
        law = Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(
            presliding=m["presliding"], rollingResistance=m["rolling_resistance"], carriedLiquid=bool(self.liquid),
            capillaryModel=m["capillary_model"] if self.scene["liquid"] != "dry" else "none")
        self.enter(case["first"])
        O.engines = [
            ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb(), Bo1_Facet_Aabb()], verletDist=5e-4),
            *([joint] if joint else []),
            InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), meets_floor],
                            [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**laws_of(case))], [law]),
            *([self.liquid] if self.liquid else []), self.account,
            PyRunner(iterPeriod=1, firstIterRun=0, initRun=True, command="stress_record()"),
            NewtonIntegrator(damping=0, gravity=Vector3(0, 0, -case["gravity"])),
        ]
        O.dt = case["step"]

    def enter(self, grains):
        for grain in grains:
            O.bodies.append(sphere(grain, self.material, self.case["density"]))

    def insert(self):
        self.enter(self.case["inserted"])

    def record(self):
        if O.iter % self.case["every"]:
            return
        table = []
        for body in O.bodies:
            if isinstance(body.shape, Sphere):
                state = body.state
                force = np.array(O.forces.f(body.id)) - [0.0, 0.0, state.mass * self.case["gravity"]]
                table.append([body.id, *state.pos, *state.vel, *force, body.shape.radius, state.mass])
        self.rows.append((O.iter, np.array(table).reshape(-1, 12)))

    def shake(self):
        O.engines = [*O.engines[:-1], self.shaker, O.engines[-1]]
        self.shaker.start()

    def go(self):
        case, moves = self.case, self.shaker is not None
        # PyRunner finds its names in the builtins.
        builtins.stress_record, builtins.stress_insert = self.record, self.insert
        if moves and not self.scene["late"]:
            self.shake()
        O.run(case["first_steps"], True)
        self.enter(case["second"])
        if self.scene["entering"] == "grown":
            for body in O.bodies:
                if isinstance(body.shape, Sphere):
                    resize(body, case["growth"] * body.shape.radius, case["density"])
        if moves and self.scene["late"]:
            self.shake()
        if case["inserted"]:
            O.engines = [PyRunner(iterPeriod=300, nDo=1, firstIterRun=800, command="stress_insert()"), *O.engines]
        O.run(case["steps"] + 1 - O.iter, True)
        energies = self.account.energies()
        found = {"steps": np.array([step for step, _ in self.rows]),
                 "energy": np.array([energies[name] for name in ("balance", "other", "scale")]),
                 "liquid": np.array([self.liquid.total() + self.liquid.lost if self.liquid else 0.0])}
        return found | {f"frame{k}": table for k, (_, table) in enumerate(self.rows)}


cases, out = sys.argv[1:3]
with open(cases, encoding="utf-8") as file:
    cases = json.load(file)
np.savez(out, **{f"{n}/{name}": value for n, case in enumerate(cases) for name, value in Run(case).go().items()})
print("rig: finished", flush=True)
