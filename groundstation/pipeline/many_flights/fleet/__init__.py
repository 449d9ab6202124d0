"""Folder of flights as a fleet: the dataset of flights, index, statistics, installations."""
