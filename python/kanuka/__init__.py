"""Kanuka"""
