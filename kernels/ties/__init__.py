"""Attachments between bodies: points that are tied to each other."""
