"""LIGGGHTS, in the program liggghts-dembark: LIGGGHTS-PUBLIC with dembark's styles."""

from __future__ import annotations

from .base import EngineFacts, RigidBody
from .input_script import InputScript, row


class Liggghts(InputScript):
    """LIGGGHTS's input script; MPI ranks of Open MPI."""

    facts = EngineFacts.read("liggghts")

    @classmethod
    def body_files(cls, body: RigidBody) -> dict[str, str]:
        """See Engine: a template for `fix multisphere`, and the particles of a `fix sph/body` where these are on a lattice."""
        name, (xx, yy, zz, xy, xz, yz) = body.name, body.moments
        # With use_volume it would take the centre of mass of the spheres.
        template = f"""\
# {body.about()}
# A template for fix particledistribution/discrete; `fix ID all multisphere` moves what is inserted. Set the variables before for others.
variable {name}_atom_type index 1
variable {name}_number    index 1
fix {name} all particletemplate/multisphere 15485863 atom_type ${{{name}_atom_type}} density constant {body.density!r} &
    volume_limit {1e-3 * body.mass / body.density!r} nspheres {len(body.spheres)} ntry 100000 spheres file {name}.spheres scale 1.0 &
    mass {body.mass!r} inertia_tensor {row((xx, xy, xz, yy, yz, zz))} use_density type ${{{name}_number}}
"""
        files = {f"{name}.spheres": "".join(f"{row(sphere)}\n" for sphere in body.spheres), f"{name}-liggghts.in": template}
        if body.principal and body.lattice:
            x, y, z = body.centre
            places = "".join(f"create_atoms ${{{name}_atom_type}} single {row((x + a, y + b, z + c))} units box\n"
                             for a, b, c, _ in body.spheres)
            files[f"{name}-sph.in"] = f"""\
# {body.about()}
# Particles for pair_style sph/coupled; after it: fix ID {name} ${{{name}_sph}}
variable {name}_atom_type index 1
variable {name}_sph string "sph/body mass {body.mass!r} inertia {row((xx, yy, zz))} centre {row(body.centre)}"
{places}group {name} type ${{{name}_atom_type}}
"""
        return files
