"""What a problem declares: configuration, observed fields, actions, seeds, and how learners train on a role."""
