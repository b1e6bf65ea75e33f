"""Drawing of the HVAC problem."""
