"""The report of a campaign: studies along its parameters, numerical uncertainty, and tables."""
