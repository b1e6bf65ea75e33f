"""A heated building under sensor attack, and moving target defence: chapter 4 and appendix C of the dissertation."""
