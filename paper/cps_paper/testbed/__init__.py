"""Section 2.5 reproduced: the three experiments on the simulated test bed."""
