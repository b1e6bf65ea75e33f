"""Chapter 2 again: its tables, figures and claims, computed by our code and put beside what the paper prints."""
