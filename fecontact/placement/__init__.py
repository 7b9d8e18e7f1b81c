"""Wheel on rail as rigid bodies: poses, touch points, curvatures and wheelsets."""
