"""From numbers with intervals to verdicts."""
