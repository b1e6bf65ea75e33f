"""The tables that the dissertation prints, as CSV files, and what it means to agree with them."""
