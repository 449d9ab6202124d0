"""What a folder of flights says together: the dataset of flights, index, statistics, installations."""
