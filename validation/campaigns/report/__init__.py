"""The report of a campaign: studies along its parameters, numerical uncertainty, tables, and what changed against another one."""

from dembark.validation.campaigns.report.build import build

__all__ = ["build"]
