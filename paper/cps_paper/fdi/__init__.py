"""Chapter 3 computed by our code and put beside what the paper prints."""
