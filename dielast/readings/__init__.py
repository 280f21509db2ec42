"""Measurements from the files of a laboratory: plain tables, and exports of instruments."""
