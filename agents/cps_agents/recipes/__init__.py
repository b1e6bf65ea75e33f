"""How the shipped policies were trained: one module per problem and role."""
