"""Runs inside YADE: `yade -n -x yade_script.py cases.json out.npz`. System Python; numpy only."""

import builtins
import json
import sys

import numpy as np
from yade import utils


class Prescribe:
    """Puts the grains on their paths before the forces of a step."""

    def __init__(self, ids, position, velocity, spin):
        self.ids, self.position, self.velocity, self.spin = ids, position, velocity, spin
        self.step = 1

    def __call__(self):
        for i, body in enumerate(self.ids):
            state = O.bodies[body].state
            state.pos = Vector3(*self.position[self.step, i])
            state.vel = Vector3(*self.velocity[self.step, i])
            state.angVel = Vector3(*self.spin[self.step, i])
        self.step += 1


class Record:
    """Full-step velocities and forces between the force evaluation and the integrator."""

    def __init__(self, ids, case, first):
        self.ids, self.case, self.step = ids, case, first
        self.rows = []

    def __call__(self):
        step = self.step
        self.step += 1
        if step == 0 or step % self.case["stride"]:
            return
        dt, free, g = self.case["time_step"], not self.case["prescribed"], np.array(self.case["gravity"])
        row = [step * dt]
        for body in self.ids:
            state = O.bodies[body].state
            velocity, spin = np.array(state.vel), np.array(state.angVel)
            force, torque = np.array(O.forces.f(body)), np.array(O.forces.t(body))
            if free:
                force = force + state.mass * g
                velocity = velocity + 0.5 * dt * force / state.mass
                spin = spin + 0.5 * dt * torque / np.array(state.inertia)
            row += [*state.pos, *velocity, *spin, *force, *torque]
        self.rows.append(row)


def wall_of(surface, material, time_step):
    """Body and engines of a wall: the floor z = 0 by default. Grains on a path are one step ahead at the first forces."""
    kind = surface.get("kind", "wall")
    if kind == "cylinder":
        body = Body()
        body.shape, body.state.pos = CylinderWall(radius=surface["radius"], axis=(1, 0, 0)), Vector3(0, 0, surface["radius"])
        body.material, body.state.blockedDOFs = material, "xyzXYZ"
    elif kind == "box":
        body = utils.box((0, 0, -0.01), (0.1, 0.1, 0.01), fixed=True, material=material)
    elif kind == "wall":
        body = utils.wall(0.0, axis=2, sense=1, material=material)
    else:  # its middle is the origin, so that it turns about that
        body = utils.facet([(-0.1 * 3**0.5, -0.1, 0), (0.1 * 3**0.5, -0.1, 0), (0, 0.2, 0)], material=material)
    body.state.vel, body.state.angVel = Vector3(*surface.get("velocity", (0, 0, 0))), Vector3(*surface.get("spin", (0, 0, 0)))
    body.state.pos += time_step * body.state.vel
    joint = FacetSurface() if kind == "joined facet" else None
    return body, joint, Ig2_FacetSurface_Sphere_ScGeom(surface=joint) if joint else Ig2_Facet_Sphere_ScGeom()


def run(case, arrays):
    O.reset()
    m = case["material"]
    laws = dict(
        restitution=m["restitution"], staticFriction=m["static_friction"], kineticFriction=m["kinetic_friction"],
        criticalSlipDistance=m["critical_slip_distance"], interfaceShearStrength=min(m["interface_shear_strength"], 1e300),
        healingTime=m["healing_time"])
    if m["rolling_resistance"] != "off":
        laws.update(rollingFriction=m["rolling_friction"], rollingDampingRatio=m["rolling_damping_ratio"])
    hooke = {"characteristicVelocity": m["characteristic_velocity"]} if m["normal_law"] == "hooke" else {}
    wet = m["bridge_volume"] > 0.0
    if wet:
        laws.update(bridgeVolume=m["bridge_volume"], contactAngle=m["contact_angle"], surfaceTension=m["surface_tension"],
                    liquidViscosity=m["viscosity"], minimumGap=m["minimum_gap"])
    gravity = Vector3(*case["gravity"])
    ids = []
    for g in case["grains"]:
        material = O.materials.append(FrictMat(young=m["youngs_modulus"], poisson=m["poisson_ratio"], density=g["density"]))
        body = utils.sphere(Vector3(*g["position"]), g["radius"], material=material)
        body.state.vel = Vector3(*g["velocity"]) - 0.5 * case["time_step"] * gravity
        body.state.angVel = Vector3(*g["angular_velocity"])
        ids.append(O.bodies.append(body))
    wall, joint, facets = wall_of(case.get("surface", {}), O.materials[-1], case["time_step"])
    if case["wall"]:
        O.bodies.append(wall)
    first = 1 if case["prescribed"] else 0
    move, record = None, Record(ids, case, first)
    engines = [
        ForceResetter(),
        # The grains are moved from outside, so the collider looks at each step.
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb(), Bo1_Box_Aabb(), Bo1_Facet_Aabb(), Bo1_CylinderWall_Aabb()],
                              verletDist=0),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom(), facets, Ig2_CylinderWall_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**laws)],
            [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(
                **hooke, normalLaw=m["normal_law"], presliding=m["presliding"], frictionLimit=m["friction_limit"],
                rollingResistance=m["rolling_resistance"],
                capillaryModel=m["capillary_model"] if wet else "none")]),
        NewtonIntegrator(damping=0, gravity=gravity),
    ]
    O.dt = case["time_step"]
    if case["prescribed"]:
        move = Prescribe(ids, *arrays)
    # PyRunner finds its names in the builtins.
    builtins.rig_move, builtins.rig_record = move, record
    engines[2:2] = [joint] if joint else []
    O.engines = ([PyRunner(iterPeriod=1, firstIterRun=0, initRun=True, command="rig_move()")] if move else []) + engines[:-1] + [
        PyRunner(iterPeriod=1, firstIterRun=0, initRun=True, command="rig_record()")] + engines[-1:]
    # O.run() has a thread of its own, which waits for Python in every step.
    for _ in range(case["steps"] + 1 - first):
        O.step()
    return np.array(record.rows)


cases, out = sys.argv[1:3]
with open(cases, encoding="utf-8") as file:
    cases = json.load(file)
results = {}
for case in cases:
    arrays = None
    if case["prescribed"]:
        with np.load(case["arrays"]) as stored:
            arrays = [stored[name] for name in ("position", "velocity", "spin")]
    results[case["name"]] = run(case, arrays)
np.savez(out, **results)
print("rig: finished", flush=True)
