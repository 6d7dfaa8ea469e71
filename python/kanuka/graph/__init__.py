"""Shader networks: nodes and connections, turned into one RSL shader. docs/graph.md."""

from .network import GraphError, Node, ShaderGraph
from .nodes import NODE_TYPES

__all__ = ["NODE_TYPES", "GraphError", "Node", "ShaderGraph"]
