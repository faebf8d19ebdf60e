"""Runs inside YADE: `PYTHONPATH=. yade -n -x idiom_scenes.py out.json scene...`. What scripts bring from YADE's own laws."""

import math

from scene_results import advance, place, write_results
from yade import dembark, utils

PAIR = dict(restitution=0.6, staticFriction=0.5, kineticFriction=0.5, criticalSlipDistance=0)
LOOPS = {"stock": InteractionLoop, "short": SphereContactLoop}
R = 0.0025


def answer(do):
    """The kind and the text of what `do()` raises; `nothing` for nothing."""
    try:
        do()
    except (RuntimeError, AttributeError, KeyError, NameError, ImportError) as error:
        return [type(error).__name__, str(error)]
    return ["nothing", "nothing"]


def pressed(loop="stock", bodies=None, pair=None, law=None, damping=0.0, **more):
    """Two spheres that overlap (m): body 0 held below, body 1 drawn across it; returns Ip2 and law."""
    O.reset()
    place(bodies or [utils.sphere((0, 0, 0), R, fixed=True), utils.sphere((0, 0, 1.99 * R), R)], 2500.0)
    O.dt = 1e-6
    ip2 = Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**{**PAIR, **(pair or {})})
    law = Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(**(law or {}))
    O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=0.1 * R),
                 LOOPS[loop]([Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()], [ip2], [law]),
                 NewtonIntegrator(damping=damping, **more)]
    return ip2, law


def attributes():
    """What objects say when a script sets attributes of other laws, misspelt ones, and those that are computed."""
    ip2, law = pressed()
    advance(2)
    contact = O.interactions[0, 1].phys
    engines = {"loop": SphereContactLoop(), "liquid": CapillaryLiquid(), "account": EnergyAccount(), "monitor": IntegrationMonitor(),
               "impact": LcpImpact(), "wall": LogWall(), "fluid": SphFluid(), "motion": WallMotion(), "drum": CylinderWall(),
               "capsule": Capsule(), "snapshot": DembarkSnapshot(), "surface": FacetSurface(), "facets": Ig2_FacetSurface_Sphere_ScGeom(),
               "box": Bo1_CylinderWall_Aabb(), "cylinders": Ig2_CylinderWall_Sphere_ScGeom()}
    objects = {"contact": contact, "ip2": ip2, "law": law, **engines}
    names = {"contact": ("tangensOfFrictionAngle", "kn", "ks", "normalForce", "shearForce", "kno", "betan", "capillaryForce", "slipp"),
             "ip2": ("frictAngle", "betan", "betas", "en", "es", "krot", "ktwist", "eta", "gamma", "restituton"),
             "law": ("useDamping", "includeMoment", "includeAdhesion", "calcEnergy", "preventGranularRatcheting", "neverErase",
                     "traceEnergy", "presliding_", "capillarymodel")}
    said = {f"{who}.{name}": answer(lambda one=objects[who], name=name: setattr(one, name, getattr(one, name, 0.5)))
            for who, words in {**names, **dict.fromkeys(engines, ("wrong",))}.items() for name in words}
    # What is right goes on.
    contact.staticFriction = contact.kineticFriction = 0.2
    contact.elasticDisplacement = Vector3(1e-9, 0, 0)
    law.tangentialDamping = False
    O.interactions[0, 1].phys.bridgeVolume = 0
    advance(1)
    return said


def words():
    """The same words given when objects are made."""
    return {name: answer(make) for name, make in {
        "ip2": lambda: Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(frictAngle=0.5),
        "law": lambda: Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(includeMoment=True),
        "loop": lambda: SphereContactLoop(wrong=1)}.items()}


def friction_changed():
    """Friction coefficients changed under a running scene in each way that YADE has, with both loops, and what the next steps say."""
    def contact_friction(angle):
        def change():
            utils.setContactFriction(angle)
        return change

    def material():
        O.materials[0].frictionAngle = 0.3
        O.bodies.append(utils.sphere((1.9 * R, 0, 0), R, material=O.materials[0]))

    def triaxial():
        ThreeDTriaxialEngine().setContactProperties(20.0)

    found = {}
    for loop in LOOPS:
        for name, change in {"0.5 rad": contact_friction(0.5), "no friction": contact_friction(0.0),
                             "45 degrees": contact_friction(math.pi / 4), "material": material, "triaxial engine": triaxial}.items():
            pressed(loop)
            advance(3)
            change()
            found[f"{loop} {name}"] = answer(lambda: advance(2))
            found[f"{loop} {name} again"] = answer(lambda: advance(2))
            dembark.set_friction(0.4)
            found[f"{loop} {name} mended"] = answer(lambda: advance(2))
    return found


def _pulled(static, change=None, loop="stock"):
    """Shear over normal force of a sphere that is drawn along far enough to slip."""
    pressed(loop, pair=dict(staticFriction=static, kineticFriction=static))
    O.bodies[1].state.blockedDOFs = "xyzXYZ"
    O.bodies[0].state.blockedDOFs = "xyzYZ"  # two bodies that are held exert no force
    O.bodies[1].state.vel = Vector3(0.5, 0, 0)
    advance(20)
    if change:
        change()
    advance(20)
    contact = O.interactions[0, 1].phys
    return contact.shearForce.norm() / contact.normalForce.norm()


def friction_set():
    """dembark.set_friction: of what slides already, of what comes, of a pair of materials only, and what it refuses."""
    found = {"before": _pulled(0.5)}
    for loop in LOOPS:
        found[loop] = _pulled(0.5, lambda: dembark.set_friction(0.2), loop)
        found[f"{loop} other pair"] = _pulled(0.5, lambda: dembark.set_friction(0.2, materials=(0, 1)), loop)
        found[f"{loop} after setContactFriction"] = _pulled(0.5, lambda: (utils.setContactFriction(0.1), dembark.set_friction(0.2)), loop)
    ip2, _ = pressed(pair=dict(staticFriction=MatchMaker(matches=((0, 0, 0.5), (0, 1, 0.3))), kineticFriction=0.1))
    dembark.set_friction(0.7, 0.6, materials=(0, 0))
    found["pairs"] = [ip2.staticFriction(0, 0), ip2.staticFriction(0, 1), ip2.kineticFriction(0, 0), ip2.kineticFriction(1, 0)]
    found["wrong"] = answer(lambda: dembark.set_friction(0.2, 0.3))
    O.engines = [ForceResetter()]
    found["no functor"] = answer(lambda: dembark.set_friction(0.2))
    return found


def materials():
    """Materials whose further attributes this law disregards."""
    found = {}
    for name, make in {"CohFrictMat": lambda: CohFrictMat(isCohesive=True, normalCohesion=1e6),
                       "ViscElMat": lambda: ViscElMat(tc=1e-3, en=0.3, et=0.3),
                       "ViscElCapMat": lambda: ViscElCapMat(Capillar=True, Vb=1e-11, gamma=0.07, theta=0)}.items():
        pressed()
        own = O.materials.append(make())
        O.materials[own].young, O.materials[own].poisson = 5e6, 0.3
        O.bodies[1].mat = O.materials[own]
        found[name] = answer(lambda: advance(1))
    return found


def foreign_engines():
    """Engines that take contacts for those of their own law."""
    found = {}
    for name, make in {"Law2_ScGeom_CapillaryPhys_Capillarity": Law2_ScGeom_CapillaryPhys_Capillarity,
                       "ElasticContactLaw": ElasticContactLaw, "viscEl": lambda: GlobalStiffnessTimeStepper(viscEl=True)}.items():
        pressed()
        O.engines = [*O.engines[:3], make(), O.engines[3]]
        found[name] = answer(lambda: advance(1))
        found[f"{name} again"] = answer(lambda: advance(1))
    return found


def warned():
    """Numerical damping and O.trackEnergy with the law; the warnings are on stderr."""
    for damping, track in ((0.2, False), (0.0, True), (0.3, True)):
        pressed(damping=damping)
        O.trackEnergy = track
        advance(20)
    pressed()
    advance(2)
    O.engines[3].damping = 0.4  # while the scene runs
    O.bodies.append(utils.sphere((0, 1.9 * R, 0), R))
    advance(2)
    return True


def time_step():
    """GlobalStiffnessTimeStepper over the law; a viscous bridge whose time step is lengthened; PWaveTimeStep."""
    pressed()
    stepper = GlobalStiffnessTimeStepper(timeStepUpdateInterval=1, timestepSafetyCoefficient=0.5, defaultDt=1e-6)
    O.engines = [*O.engines[:3], stepper, O.engines[3]]
    advance(3)
    contact, grain = O.interactions[0, 1].phys, O.bodies[1]
    found = {"step": O.dt, "kn": contact.kn, "ks": contact.ks, "mass": grain.state.mass, "inertia": grain.state.inertia[0],
             "wave": utils.PWaveTimeStep()}
    wet = dict(bridgeVolume=2e-11, surfaceTension=0.072, contactAngle=0.35, liquidViscosity=1.0, minimumGap=1e-5)
    for loop in LOOPS:
        pressed(loop, pair=wet, law=dict(capillaryModel="exact"))
        advance(5)
        O.dt = 1e-2
        found[f"viscous {loop}"] = answer(lambda: advance(1))
    return found


def grown_later():
    """A column in which bodies come and grow while it runs, larger than all before, on both loops, dry and with bridges: the largest
    overlap over the radius, and how many pairs that overlap have no contact."""
    found = {}
    for loop in LOOPS:
        for wet in (False, True):
            pair = dict(bridgeVolume=2e-11, surfaceTension=0.072, contactAngle=0.35) if wet else {}
            for how in ("append", "factory", "grow one", "grow all", "radius"):
                pressed(loop, [utils.wall(0, 2), *(utils.sphere((0.1 * R * (k % 2), 0, (1 + 2.1 * k) * R), R) for k in range(3))], pair,
                        dict(capillaryModel="exact") if wet else {}, gravity=(0, 0, -9.81))
                O.dt = 1e-5
                advance(500)
                if how == "append":  # ten times as large as all before
                    O.bodies.append([utils.sphere((12 * R, 0, 10.1 * R), 10 * R), utils.sphere((-12 * R, 0, 10.1 * R), 10 * R),
                                     utils.sphere((0, 0, 25 * R), 10 * R)])
                elif how == "factory":
                    factory = BoxFactory(maxParticles=3, extents=(6 * R, 6 * R, R), center=(0, 0, 25 * R), rMin=3 * R, rMax=4 * R, vMin=1,
                                         vMax=1, vAngle=0, normal=(0, 0, -1), massFlowRate=10, materialId=0, stopIfFailed=False)
                    O.engines = [*O.engines[:-1], factory, O.engines[-1]]
                worst = {"deepest": 0.0, "missing": 0, "touching": 0}
                for _ in range(60):
                    if how == "grow one":
                        utils.growParticle(1, 1.01)
                    elif how == "grow all":
                        utils.growParticles(1.01)
                    elif how == "radius":
                        O.bodies[2].shape.radius *= 1.01
                        O.bodies[2].state.mass *= 1.01**3
                        O.bodies[2].state.inertia *= 1.01**5
                    advance(50)
                    worst = {name: max(worst[name], value) for name, value in _overlaps().items()}
                found[f"{loop} {'wet' if wet else 'dry'} {how}"] = worst | {"count": len(O.bodies) - 1}
    return found


def grown_on_facets():
    """The same on a floor of facets, by the functor of YADE and by FacetSurface."""
    found = {}
    corners = [(-1, -1, 0), (1, -1, 0), (0, 1, 0)]
    for floor in ("facet", "surface"):
        pressed("short", [utils.facet(corners), *(utils.sphere((0.1 * R * (k % 2), 0, (1 + 2.1 * k) * R), R) for k in range(3))],
                gravity=(0, 0, -9.81))
        O.dt = 1e-5
        surface = FacetSurface()
        below = Ig2_FacetSurface_Sphere_ScGeom(surface=surface) if floor == "surface" else Ig2_Facet_Sphere_ScGeom()
        reset, collider, loop, newton = O.engines
        collider.boundDispatcher.functors = [Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()]
        loop.geomDispatcher.functors = [Ig2_Sphere_Sphere_ScGeom(), below]
        O.engines = [reset, collider, *([surface] if floor == "surface" else []), loop, newton]
        worst = {"deepest": 0.0, "missing": 0, "touching": 0}
        for n in range(60):
            if n == 5:
                O.bodies.append(utils.sphere((12 * R, 0, 10.1 * R), 10 * R))
            utils.growParticle(1, 1.01)
            advance(50)
            worst = {name: max(worst[name], value) for name, value in _overlaps().items()}
        found[floor] = worst | {"count": len(O.bodies) - 1}
    return found


def _overlaps():
    balls = [body for body in O.bodies if isinstance(body.shape, Sphere)]
    deepest, missing, touching = 0.0, 0, 0
    for k, one in enumerate(balls):
        gaps = [(0, one.shape.radius - one.state.pos[2], one.shape.radius)]
        gaps += [(two.id, one.shape.radius + two.shape.radius - (one.state.pos - two.state.pos).norm(),
                  min(one.shape.radius, two.shape.radius)) for two in balls[k + 1:]]
        for other, depth, radius in gaps:
            deepest = max(deepest, depth / radius)
            touching += depth > 0.0
            # A contact begins in the step after the one in which bodies meet.
            missing += depth > 1e-2 * radius and not O.interactions.has(other, one.id, True)
    return {"deepest": deepest, "missing": missing, "touching": touching}


def released():
    """Types in a dump of a sphere that is held at first and let go later, and of one that comes."""
    pressed(gravity=(0, 0, -9.81))
    snapshot = dembark.DumpWriter({}, ((-1, 1),) * 3, grains="released.dump", contacts=None)
    snapshot.write()
    O.bodies[0].state.blockedDOFs = ""
    snapshot.write()
    O.bodies[1].state.blockedDOFs = "xyzXYZ"
    O.bodies.append(utils.sphere((0, 0, 1), R))
    snapshot.write()
    lines = open("released.dump", encoding="ascii").read().split("ITEM: TIMESTEP\n")[1:]
    return [[line.split()[1] for line in frame.splitlines()[8:]] for frame in lines]


write_results(globals())
