"""Looks that other formats describe, as shaders: what stages of USD and files of models have in common."""
