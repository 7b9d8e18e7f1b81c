"""Reasons why a position cannot be computed, with their kind."""

from __future__ import annotations

import re

from fecontact.errors import FecontactError, InputError

_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?", re.IGNORECASE)


class PositionProblem(str):
    """Reason why a position cannot be computed.

    An example is a wheel that cannot stand on its rail. The reason is a text with further attributes.

    Attributes
    ----------
    kind
        The reason without its numbers, by which reasons are grouped.
    remedy
        The action that the user can take; empty if there is none.
    is_derailed
        Whether the wheel cannot stand there: it derails or falls between the rails. Otherwise it is unknown whether
        there is a contact.

    Examples
    --------
    >>> from fecontact.placement.problems import PositionProblem
    >>> problem = PositionProblem("the wheel derails at y = -42.3 mm", "the wheel derails", is_derailed=True)
    >>> longer = problem.extend(before="left side: ")
    >>> str(longer), longer.kind, longer.is_derailed
    ('left side: the wheel derails at y = -42.3 mm', 'the wheel derails', True)
    """

    kind: str
    remedy: str
    is_derailed: bool

    def __new__(cls, text: str, kind: str = "", *, remedy: str = "", is_derailed: bool = False) -> PositionProblem:
        """Make a reason; its kind is its text if no kind is given."""
        problem = super().__new__(cls, text)
        problem.kind, problem.remedy, problem.is_derailed = kind or text, remedy, is_derailed
        return problem

    @classmethod
    def explain(cls, cause: FecontactError | str) -> PositionProblem:
        """Reason of an error, with its kind.

        The kind is the message up to its first semicolon, with "..." for each number. The remedy is the end of the
        message.

        Parameters
        ----------
        cause
            The error, or its message.

        Returns
        -------
        PositionProblem
            The problem of a `PlacementError`, or the message with its kind.

        Examples
        --------
        >>> from fecontact.errors import InputError
        >>> from fecontact.placement.problems import PositionProblem
        >>> problem = PositionProblem.explain(InputError("the load is 3.5 kN; allowed: up to 2 kN; reduce it"))
        >>> problem.kind, problem.remedy
        ('the load is ... kN', 'reduce it')
        """
        if isinstance(cause, PlacementError):
            return cause.problem
        if isinstance(cause, PositionProblem):
            return cause
        reason, *phrases = str(cause).split("; ")
        return cls(str(cause), _NUMBER.sub("...", reason), remedy=phrases[-1] if phrases else "")

    def extend(self, *, before: str = "", after: str = "") -> PositionProblem:
        """Put texts before and after the reason.

        Parameters
        ----------
        before, after
            Texts, with their spaces.

        Returns
        -------
        PositionProblem
            Longer text of the same kind.
        """
        return PositionProblem(f"{before}{self}{after}", self.kind, remedy=self.remedy, is_derailed=self.is_derailed)


class PlacementError(InputError):
    """Error for a wheel that cannot be placed on its rail.

    Attributes
    ----------
    problem
        Message with its kind.
    """

    def __init__(self, problem: PositionProblem) -> None:
        """Make an error of a problem.

        Parameters
        ----------
        problem
            Message with its kind.
        """
        super().__init__(problem)
        self.problem = problem
