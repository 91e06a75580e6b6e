"""Derivatives of contacts, friction states and losses with respect to everything in a scene."""
