"""Friction that changes while a scene runs."""

import math

from yade import FinnieRabinowiczPhys, InteractionLoop, Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys, MatchMaker, Omega
from yade.dembark.report import fail

O = Omega()


def set_friction(static, kinetic=None, materials=None):
    """Set the friction coefficients of all contacts, and of those to come; in place of YADE's setContactFriction.

    static, kinetic : coefficients, kinetic <= static; without `kinetic` both are the same
    materials : two ids of materials, to set those of their pairs only

    Contacts keep their elastic displacement and slip. RuntimeError where the coefficients make no sense, or no Ip2 of the law is there.
    """
    kinetic = static if kinetic is None else kinetic
    if not 0.0 <= kinetic <= static < math.inf:
        fail(f"set_friction: static {static}, kinetic {kinetic}; they must be finite numbers >= 0, the kinetic one not above the static")
    pair = None if materials is None else tuple(sorted(materials))
    loops = [engine for engine in O.engines if isinstance(engine, InteractionLoop)]
    functors = [one for loop in loops for one in loop.physDispatcher.functors
                if isinstance(one, Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys)]
    if not functors:
        fail("set_friction: no InteractionLoop in O.engines has an Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys")
    for functor in functors:
        functor.staticFriction = _changed(functor.staticFriction, pair, static)
        functor.kineticFriction = _changed(functor.kineticFriction, pair, kinetic)
    for interaction in O.interactions:
        contact = interaction.phys if interaction.isReal else None
        if not isinstance(contact, FinnieRabinowiczPhys):
            continue
        if pair is None or pair == tuple(sorted(O.bodies[k].material.id for k in (interaction.id1, interaction.id2))):
            contact.staticFriction, contact.kineticFriction = static, kinetic


def _changed(known, pair, value):
    """A MatchMaker with `value` for `pair`, or for all."""
    if pair is None:
        return MatchMaker(algo="val", val=value)
    others = [tuple(each) for each in (known.matches if known else ()) if tuple(sorted((int(each[0]), int(each[1])))) != pair]
    if known is None:
        return MatchMaker(matches=[(*pair, value)])
    return MatchMaker(matches=[*others, (*pair, value)], algo=known.algo, val=known.val)
