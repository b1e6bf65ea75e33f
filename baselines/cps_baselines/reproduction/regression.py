"""What every chapter says about its regression check."""

NO_SUPPORT = (
    "Both programs are ours and share a specification and its parameters: agreement shows that the simulation is the "
    "same, and supports nothing that the paper says."
)
