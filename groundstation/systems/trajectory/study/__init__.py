"""Study of the trajectory estimator: the families that are flown, their known noise, and the judgement."""
