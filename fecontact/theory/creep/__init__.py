"""Forces of rolling contact with friction: closed laws and Kalker's simplified theory, on an ellipse and on strips."""
