"""How figures look, in the report and elsewhere."""

from typing import Any

INK, GREY, GRID = "#22262b", "#4a4f57", "#e3e6ea"
# Maps of a size and of what has a sign.
SEQUENTIAL, DIVERGING = "cividis", "RdBu_r"
# Okabe & Ito's palette.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")

# Settings for matplotlib.rc_context.
STYLE: dict[Any, Any] = {"font.size": 7.5, "axes.titlesize": 8.5, "axes.titleweight": "bold", "axes.titlelocation": "left",
                         "axes.edgecolor": "#9aa1a9", "axes.linewidth": 0.6, "axes.labelcolor": INK, "text.color": INK,
                         "xtick.color": "#555b63", "ytick.color": "#555b63", "xtick.major.width": 0.6, "ytick.major.width": 0.6,
                         "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False, "svg.hashsalt": "dembark",
                         "svg.fonttype": "path", "axes.grid": True, "grid.color": GRID, "grid.linewidth": 0.5, "lines.linewidth": 1.3,
                         "axes.axisbelow": True}
