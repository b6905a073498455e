"""Errors, files, processes and provenance, used by every room."""
