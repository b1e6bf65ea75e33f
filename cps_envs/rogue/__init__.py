"""Chapter 5: a platoon in which an attacker drives one of the vehicles."""
