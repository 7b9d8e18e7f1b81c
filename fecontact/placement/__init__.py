"""Wheel on rail as rigid bodies: poses, contact points, curvatures and wheelsets."""
