"""How a string of platoons is drawn."""
