"""Scenes of other formats as RIB: what fills a kanuka.Scene can fill a RibScene, which writes requests. docs/rib.md."""

from .scene import RibGroup, RibScene

__all__ = ["RibGroup", "RibScene"]
