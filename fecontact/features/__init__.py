"""Features that can be taken away, a folder each; `fecontact.feature_registry` finds them."""
