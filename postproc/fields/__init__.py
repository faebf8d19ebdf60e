"""Fields on a grid: coarse graining, cell averages, stresses on the faces of cells. Definitions: docs/theory/fields_theory.md."""
