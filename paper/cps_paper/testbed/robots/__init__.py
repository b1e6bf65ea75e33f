"""Section 2.5: the disbanding problem on nine simulated robots that drive a circle under a motion-capture system.

The same game on another plant. Attackers and defenders of the disbanding problem play here unchanged, so you can
measure what they are worth outside their own simulator. The test bed is for evaluation and not for training, so it has
no ids.
"""
