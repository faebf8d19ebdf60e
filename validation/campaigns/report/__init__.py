"""The report of a campaign: studies along its parameters, numerical uncertainty, and tables."""

from dembark.validation.campaigns.report.build import build

__all__ = ["build"]
