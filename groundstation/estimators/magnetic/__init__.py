"""In-flight magnetic deviation (system 3): found from turns of opposite bank, compensated, judged."""
