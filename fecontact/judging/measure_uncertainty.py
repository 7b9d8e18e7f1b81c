"""Declared uncertainties of a measure, from which the uncertainty of every contact is estimated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

MoreNodes = Literal["not compared", "added", "at least"]
"""Use of the change of a measure on more nodes: added to the uncertainty of reading, or a lower bound of it."""


@dataclass(frozen=True, kw_only=True)
class MeasureUncertainty:
    """Uncertainties of a measure that do not depend on the contact.

    All values are relative for `judging.measures.MEASURES`, and absolute for `judging.measures.MISFITS` (-). The four
    attributes without a default must be measured before a measure can be judged.

    Attributes
    ----------
    reading
        Reading the measure from 32 nodes per semi-axis; None if it has not been measured. The approach is measured
        between the cut planes of the bodies: a deeper rail changes it, and no mesh shows by how much.
    cut_planes
        Largest change of the measure if a cut plane is moved outwards by half of its distance
        (studies/02_independence.py).
    elements_reading
        Reading the measure from the elements' nodes, in addition to the change from mesh to mesh, with six elements per
        semi-axis; None if it has not been measured.
    strips
        Difference of the strip method from the half-space on the same gap; None if it has not been measured.
    common_mesh_error
        Error that two meshes with 4 and 2.7 elements per semi-axis have in common. With it, the stated uncertainty
        covers at least 81 of the 84 real positions of studies/12_uncertainty.py on which it was chosen.
    skewness_error
        Common error of meshes for a patch with a skewness of 1; the error is proportional to the skewness.
    noise
        Value that is read where the true value is zero. It adds in quadrature to the true value.
    shared_cut_planes
        Value of `cut_planes` if several separate patches share the load.
    shared_cut_planes_of_value
        The same as a fraction of the value of the measure.
    elements_order
        Power of the number of elements with which `elements_reading` decreases. It is 1 for measures that depend on
        which nodes are in contact, and for the peak.
    modulus_sensitivity
        Error of the measure as a fraction of the error of the elements' compliance. In Hertz's theory, p0 and area are
        proportional to the power 2/3 of the contact modulus, lengths to the power 1/3. A patch of two or more lobes is
        slightly more sensitive.
    lobe_load_exponent
        Power of a lobe's load to which the measure is proportional, if the measure belongs to the highest lobe alone;
        else 0.
    more_nodes
        Use of the change of the measure on more nodes of the half-space.
    irregularity_of_value
        Whether the uncertainty by an irregularity is a fraction of the deviation (True) or absolute (False).
    reference_tolerance
        Factor on the allowed error of the measure for Hertz's gap on the half-space; None if the measure is not
        compared with Hertz's ellipse.
    shows_faulty_elements
        Whether the elements' nodes and the finer nodes must agree in the measure.
    of_lobes
        Whether the measure is judged for each lobe.
    """

    reading: float | None
    cut_planes: float
    elements_reading: float | None
    strips: float | None
    common_mesh_error: float = 0.0
    skewness_error: float = 0.0
    noise: float = 0.0
    shared_cut_planes: float = 0.0
    shared_cut_planes_of_value: float = 0.0
    elements_order: int = 2
    modulus_sensitivity: float = 1.0
    lobe_load_exponent: float = 0.0
    more_nodes: MoreNodes = "not compared"
    irregularity_of_value: bool = False
    reference_tolerance: float | None = None
    shows_faulty_elements: bool = False
    of_lobes: bool = False
