"""One Kalman core for every estimator: prediction, update, gates, smoothers.

Prediction and update are sparse: they cost as much as the matrices have entries.
"""
