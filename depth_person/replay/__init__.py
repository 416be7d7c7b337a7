"""Bags: read, process, evaluate, report."""
