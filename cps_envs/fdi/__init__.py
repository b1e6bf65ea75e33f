"""False data injected into the range and range-rate sensors of a vehicle platoon."""
