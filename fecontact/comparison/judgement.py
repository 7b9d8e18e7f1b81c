"""A judged theory as a value: how far it is off the finite elements, how sure that is, and its verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from fecontact.comparison.approximation import Approximation
from fecontact.comparison.measures import Measures, measures_of_theory
from fecontact.comparison.verdict import Verdict
from fecontact.theory.hertz import HertzContact


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """A theory of the contact against the finite elements.

    Attributes
    ----------
    approximation
        What the theory says.
    deviation
        (Theory - FE) / FE of each of `MEASURES`, and the `MISFITS`.
    uncertainty
        Of the deviations, of those where it is known.
    limits
        Of the measures that decide.
    """

    approximation: Approximation
    deviation: Mapping[str, float]
    uncertainty: Mapping[str, float]
    limits: Mapping[str, float]
    verdict: Verdict

    @property
    def measures(self) -> Measures:
        """The theory's own measures."""
        return measures_of_theory(self.approximation)

    @property
    def hertz(self) -> HertzContact:
        """The ellipse of a theory that has a single one."""
        patch = self.approximation.single
        assert patch is not None
        assert patch.hertz is not None
        return patch.hertz

    @property
    def limit_used(self) -> float:
        """By how much the measure that uses most of its limit does so; the theory is off from 1 on."""
        used = [abs(self.deviation[name]) / limit for name, limit in self.limits.items()]
        return math.nan if any(math.isnan(part) for part in used) else max(used)
