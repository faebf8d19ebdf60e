"""Classes and modules that a build of YADE may lack, and what to say about them."""

import os
import re
import traceback

from yade import config

# Names, and the switch of YADE's CMake that brings them.
_NAMES = (
    (r"VTKRecorder|\w+VTKRecorder\w*", "VTK"),
    (r"qt|SnapshotEngine|OpenGLRenderer|Gl\w+_\w+", "GUI"),
    (r"gts", "GTS"),
    (r"\w*FlowEngine\w*|ThermalEngine|PartialSat\w+|UnsaturatedEngine", "PFVFLOW"),
    (r"TesselationWrapper|MicroMacroAnalyser|\w*Polyhedra\w*|KinematicLocalisation\w*", "CGAL"),
    (r"Potential(Particle|Block)\w*", "POTENTIAL_PARTICLES, ENABLE_POTENTIAL_BLOCKS"),
    (r"HydrodynamicsLawLBM|LBM\w+", "LBMFLOW"),
    (r"\w*LevelSet\w*|\w*VolumeGeom\w*", "LS_DEM"),
    (r"mpy", "MPI"),
)


def missing(error):
    """One line about the NameError or ImportError of a script when it is for a part that this build of YADE lacks; else None."""
    found = re.search(r"name '(\w+)' (?:is not defined|from 'yade)|No module named '(?:yade\.)?(\w+)'", str(error))
    name = found and (found.group(1) or found.group(2))
    option = name and next((option for names, option in _NAMES if re.fullmatch(names, name)), None)
    if not option:
        return None
    where = traceback.extract_tb(error.__traceback__)[-1]
    return (f"dembark: {os.path.basename(where.filename)}, line {where.lineno}: '{name}' is no part of this build of YADE, which has the "
            f"features {', '.join(config.features)}. Build YADE with ENABLE_{option}, set YADE_PREFIX and YADE_SOURCE_DIR, and run "
            "'make yade-plugin'")
