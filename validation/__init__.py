"""The validation harness: cases and their runs, checks against references, the report."""
