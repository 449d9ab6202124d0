"""One Kalman core for every estimator: prediction, update, gates, smoothers.

Prediction and update cost as much as the matrices have entries.
"""
