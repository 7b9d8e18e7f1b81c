"""What needs another feature is left out where that one is not there."""

from fecontact.features import FEATURES

collect_ignore = [] if "maps" in FEATURES else ["test_creep_maps.py"]
