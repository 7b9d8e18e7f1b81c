"""Feature: Hertz's spring over corrugation, flats and welds (eq. 6) and models like it, judged by the half-space."""
