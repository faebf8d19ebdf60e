"""Grains of several sorts and steel, as decks with grains_and_steel.in have them: materials, and numbers of each pair of materials."""

from yade import FrictMat, MatchMaker, Omega

O = Omega()


def sort_materials(p, sorts):
    """Materials (ids) by name, of the `sorts` of grains and of `steel`, the last: with elastic constants and densities of `p`, whose names
    begin with that of the sort."""
    def material(name, density):
        return O.materials.append(FrictMat(young=getattr(p, f"{name}_youngs_modulus"), poisson=getattr(p, f"{name}_poisson_ratio"),
                                           density=density))

    return {name: material(name, getattr(p, f"{name}_density")) for name in sorts} | {"steel": material("steel", 1.0)}


def of_sorts(p, materials, number):
    """The `number` of each pair of `materials`, as from `sort_materials`: that of `p` whose name begins with both names in their order, or
    with the one of two equal ones."""
    names = list(materials)
    pairs = [(one, other) for k, one in enumerate(names) for other in names[k:]]
    return MatchMaker(matches=[(materials[one], materials[other], getattr(p, f"{one if one == other else f'{one}_{other}'}_{number}"))
                               for one, other in pairs])
