"""Feature: does Hertz hold for the creep forces of a solved load, and which law of them does on which patch?"""
