"""Section 2.5: the disbanding problem on nine simulated robots that drive a circle under a motion-capture system.

The same game on another plant: attackers and defenders of the disbanding problem play here unchanged, so that what they
are worth off their own simulator can be measured. It is evaluated on and not trained on, hence it has no ids.
"""
