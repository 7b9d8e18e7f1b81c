"""A wheel on a rail: poses, touch points and the true gap."""
