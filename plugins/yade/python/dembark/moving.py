"""Walls that move as prescribed, in decks: facets of a mesh file, the engines that move them, and their columns of time.csv."""

from yade import FacetSurface, Omega, WallMotion, utils
from yade.dembark.report import fail

O = Omega()

COMMON = ("motion_x", "motion_y", "motion_z", "motion_angle", "motion_vx", "motion_vy", "motion_vz", "motion_rate")
FORCE, OF_WALL = ("fx", "fy", "fz"), ("tx", "ty", "tz", "power", "work", "jx", "jy", "jz")
_LABEL = "motion_of_"


def mesh(path, material, mask=1):
    """Ids of held facets with the triangles of an STL file (m), text or binary, of one `material` (id) and `mask`.

    Triangles without area and triangles given again are left out, as by the other engines.
    """
    triangles = FacetSurface.readStl(str(path))
    return O.bodies.append([utils.facet(three, fixed=True, material=material, mask=mask) for three in triangles])


def motion(p, walls, moving, still=()):
    """Engines that move the walls `moving` together, by the words `p.motion_words`, and look after those `still`. For `engine_loop`.

    `walls`: name -> id of a body, or ids. The bodies get the velocity that they have before the first step.
    """
    # A new scene has engines already, among which these do not stand yet.
    O.engines = []
    engines = []
    for name in (*moving, *still):
        if name not in walls:
            fail(f"motion: there is no wall '{name}'; walls are {', '.join(walls)}")
        ids = [walls[name]] if isinstance(walls[name], int) else list(walls[name])
        words = " ".join(map(str, p.motion_words)) if name in moving and p.motion_words else "uniform velocity 0 0 0"
        engines.append(WallMotion(ids=ids, motion=words, label=_LABEL + name))
        engines[-1].start()
    return engines


def _columns(engine, walls):
    return OF_WALL if engine.label.removeprefix(_LABEL) in walls else FORCE + OF_WALL


def motion_columns(moving, walls=()):
    """Names of the columns of `motion_values`, for the engines `moving` of `motion`."""
    names = [f"{engine.label.removeprefix(_LABEL)}_{what}" for engine in moving for what in _columns(engine, walls)]
    return [*(COMMON if names else ()), *names]


def motion_values(moving, walls=()):
    """Numbers of this step (SI units): where the walls are and how they move, then what each does to the grains: force (but of those in
    `walls`, for which others write it), torque, power, work and impulse.

    Called from an engine between InteractionLoop and the engines of `moving`.
    """
    # A scene that was loaded has engines of its own.
    now = {engine.label: engine for engine in O.engines if isinstance(engine, WallMotion)}
    engines = [now[engine.label] for engine in moving]
    for engine in engines:
        engine.measure()
    common = [*engines[0].displacement, engines[0].angle, *engines[0].velocity, engines[0].rate] if engines else []
    numbers = [dict(zip(FORCE + OF_WALL, (*e.force, *e.torque, e.power, e.work, *e.impulse), strict=True)) for e in engines]
    return [*common, *(known[what] for e, known in zip(engines, numbers, strict=True) for what in _columns(e, walls))]
