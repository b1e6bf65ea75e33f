"""How the test bed is drawn."""
