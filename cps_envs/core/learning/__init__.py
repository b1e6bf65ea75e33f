"""The interface that learners meet: adapters, frame skip and scaled inputs around a role."""
