"""Chapter 5 computed by our code and put beside what the paper says."""
