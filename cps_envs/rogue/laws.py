"""The laws that an intact vehicle can drive by, as the kernels number them."""

from __future__ import annotations

LINEAR = 0  # bidirectional proportional-derivative, (5.15)
SLIDING = 1  # sliding mode on both sides at once, (5.9) to (5.11)
FRONT = 2  # sliding mode on the front neighbour only; for the leader on its reference
REAR = 3  # sliding mode on the rear neighbour only; the rear vehicle has none and keeps its speed
HUMAN = 4  # a human driver, (2.5)
DETECTING = 5  # SLIDING until the vehicle's own alarm, then FRONT or REAR, whichever side raised it
COMMANDED = 6  # the acceleration that the defender commands

LAWS = ("linear", "sliding", "front", "rear", "human", "detecting")  # what the defender selects from
DRIVEN = LAWS[:DETECTING]  # what a vehicle can be seen to drive by
