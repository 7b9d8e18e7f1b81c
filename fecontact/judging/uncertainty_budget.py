"""Contributions to the numerical uncertainty of a measure."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True, kw_only=True)
class UncertaintyBudget:
    """Contributions to the uncertainty of a measure, which add up to it.

    Each contribution is a bound of an error, not a standard deviation. Most of the errors have a sign of their own in
    every contact: coarse meshes are too stiff, nodes miss the highest peak, cut planes make the bodies too stiff.
    Errors of the same sign do not cancel, so the bounds are added. Of 60 exact contacts without an ellipse
    (studies/12_uncertainty.py, without the cut planes), the root of the sum of squares covers the error of the valley
    in 82 %, and of area, half-width b and centre in 90 %; the sum covers at least 96 % in each measure. A single pair
    is not added: the change on more nodes replaces the uncertainty of reading if it is larger, since both measure the
    same error.

    All values are relative for `judging.measures.MEASURES`, and absolute for `judging.measures.MISFITS` (-). A
    contribution that does not apply is 0.

    Attributes
    ----------
    reading
        Reading the measure from the nodes of the pressure.
    more_nodes
        Change of the measure on more nodes, beyond `reading` where the change is a lower bound.
    mesh_change
        Change of the measure from mesh to mesh.
    common_mesh_error
        Error that all meshes have in common.
    skewness
        Common error of meshes for a skew pressure.
    fit_difference
        Difference between the two fits that separate the compliance of the elements from the compliance of the bodies.
    cut_planes
        Position of the cut planes at which the bodies end.
    joined_lobe
        Load of the highest lobe among joined lobes.
    turned_force
        Force along the contact normal of another position in the patch.
    elements_compliance
        Error of the compliance of the elements.
    residual
        Residual of the contact solution.
    plastic_step
        Uncertainty of the step from elastic to plastic bodies.
    irregularity
        Irregularities that are in the gap but in no mesh.
    profile_variants
        Profile variants that are consistent with the measured points.

    Examples
    --------
    >>> from fecontact.judging.uncertainty_budget import UncertaintyBudget
    >>> budget = UncertaintyBudget(reading=0.001, cut_planes=0.002)
    >>> f"{budget.total:.4f}", budget.largest
    ('0.0030', 'cut_planes')
    """

    reading: float = 0.0
    more_nodes: float = 0.0
    mesh_change: float = 0.0
    common_mesh_error: float = 0.0
    skewness: float = 0.0
    fit_difference: float = 0.0
    cut_planes: float = 0.0
    joined_lobe: float = 0.0
    turned_force: float = 0.0
    elements_compliance: float = 0.0
    residual: float = 0.0
    plastic_step: float = 0.0
    irregularity: float = 0.0
    profile_variants: float = 0.0

    @property
    def total(self) -> float:
        """Sum of all contributions (-)."""
        return sum(self.contributions.values())

    @property
    def largest(self) -> str:
        """Name of the largest contribution; the first of equal contributions."""
        contributions = self.contributions
        return max(contributions, key=lambda name: contributions[name])

    @property
    def contributions(self) -> dict[str, float]:
        """Contributions (-) by name."""
        return {contribution.name: getattr(self, contribution.name) for contribution in fields(self)}

    def scaled(self, factor: float) -> UncertaintyBudget:
        """Budget with all contributions multiplied by a factor (-)."""
        return UncertaintyBudget(**{name: factor * value for name, value in self.contributions.items()})
