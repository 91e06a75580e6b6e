"""Derivatives of contacts, friction states and losses by all parameters of a scene."""
