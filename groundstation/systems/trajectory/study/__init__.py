"""Study of the trajectory estimator: families, their known noise, judgement."""
