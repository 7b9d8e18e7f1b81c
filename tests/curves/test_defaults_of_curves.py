"""Defaults of the options of `fecontact curve`."""

import inspect

import fecontact
from fecontact.features.curves.command import CurveOptions


def test_options_have_the_defaults_of_the_function_and_of_the_conditions():
    options, conditions = CurveOptions(), fecontact.Conditions()
    defaults = {name: parameter.default for name, parameter in inspect.signature(fecontact.curve).parameters.items()}
    assert (options.vehicle, options.bogie, (options.theory,)) == tuple(
        defaults[name] for name in ("vehicle", "bogie", "theories")
    )
    assert tuple(options.read_radii()) == defaults["radii_m"]
    for name in ("friction", "cant_mm", "unbalanced_m_s2", "speed_km_h"):
        assert getattr(options, name) == getattr(conditions, name)
    assert options.workers == defaults["workers"]
