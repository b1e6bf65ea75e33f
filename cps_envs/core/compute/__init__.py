"""Compiled kernels: how they are made, kept and fed, and the random numbers and clocks that they share."""
