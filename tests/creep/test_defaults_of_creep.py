"""Defaults of the options of `fecontact creep`."""

import inspect

import fecontact
from fecontact.features.creep import command


def test_options_have_the_defaults_of_the_function():
    defaults = {name: parameter.default for name, parameter in inspect.signature(fecontact.creep).parameters.items()}
    options = command.EllipseOptions(a_mm=5.0, b_mm=5.0, normal_force_kn=80.0, friction=0.3)
    assert (options.xi, options.eta, options.spin_per_mm) == defaults["creepages"]
    assert (options.young_mpa, options.poisson) == (defaults["young_MPa"], defaults["poisson"])
    assert (inspect.signature(command.creep).parameters["theory"].default,) == defaults["theories"]
