"""How figures look, in the report and elsewhere."""

from typing import Any

INK, GRID = "#22262b", "#e3e6ea"

# Settings for matplotlib.rc_context.
STYLE: dict[Any, Any] = {"font.size": 7.5, "axes.titlesize": 8.5, "axes.titleweight": "bold", "axes.titlelocation": "left",
                         "axes.edgecolor": "#9aa1a9", "axes.linewidth": 0.6, "axes.labelcolor": INK, "text.color": INK,
                         "xtick.color": "#555b63", "ytick.color": "#555b63", "xtick.major.width": 0.6, "ytick.major.width": 0.6,
                         "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False, "svg.hashsalt": "dembark",
                         "svg.fonttype": "path", "axes.grid": True, "grid.color": GRID, "grid.linewidth": 0.5, "lines.linewidth": 1.3,
                         "axes.axisbelow": True}
