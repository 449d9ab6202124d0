"""One Kalman core for every estimator: prediction and update at the cost of their entries, gates, smoothers."""
