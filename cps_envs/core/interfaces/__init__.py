"""Gymnasium, vector and PettingZoo environments of any problem: views of one simulator."""
