"""Disbanding vehicle platoons: chapter 2 and appendix A of the dissertation."""
