"""Functions of a user for tests: workers import them from this module."""

import numpy as np


def peak(contact):
    return contact.pressure_MPa.max()


def node_area(contact):
    return contact.weight_mm2[contact.pressure_MPa > 0.0].sum()


def mean_pressure(contact):
    return contact.normal_force_N / node_area(contact)


def total_load(contact):
    return (contact.pressure_MPa * contact.weight_mm2).sum()


def outer_load(contact):
    return (contact.pressure_MPa * contact.weight_mm2)[:, np.abs(contact.s_mm) > 2.0].sum()


def load_beyond_1_m(contact):
    return (contact.pressure_MPa * contact.weight_mm2)[:, contact.s_mm > 1000.0].sum()


def centre(contact):
    return (contact.pressure_MPa * contact.weight_mm2 * contact.s_mm).sum() / contact.normal_force_N


def mean_gap(contact):
    return (contact.pressure_MPa * contact.weight_mm2 * contact.gap_mm).sum() / contact.normal_force_N


def leaving(contact):
    raise SystemExit(0)


def failing(contact):
    return contact.pressure_MPa.shape[5]


def undefined(contact):
    return float("nan")


def text(contact):
    return "high"


def fine_peak(contact):
    """Peak on 65 nodes or more and on the nodes of elements, and not between."""
    return float("nan") if 30 < contact.s_mm.size < 65 else contact.pressure_MPa.max()
