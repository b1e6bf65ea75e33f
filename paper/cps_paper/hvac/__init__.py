"""Chapter 4 computed by our code and put beside what the paper prints."""
