"""The quantities of `validation.judge.quantity`, under the name that checks know."""

from dembark.validation.judge.quantity import Quantity, judge, measured

__all__ = ["Quantity", "judge", "measured"]
