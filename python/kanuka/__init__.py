"""Kanuka, a production renderer that shades before it traces.

import kanuka

scene = kanuka.Scene()
scene.camera = kanuka.Camera(origin=(0, 1, 5), target=(0, 0, 0), fov=40)
scene.add_mesh(points, faces, material=kanuka.Material("matte", color=(0.8, 0.2, 0.1)))
scene.add_light("distant", amount=3, direction=(-1, -1, -1))
picture = kanuka.render(scene, progressions=64)
picture.write("picture.exr")
"""

from ._native import (
    Camera,
    Comparison,
    CompiledShader,
    Error,
    Group,
    Journal,
    Material,
    Message,
    Options,
    Picture,
    Scene,
    Shader,
    Spectrum,
    ZTestResult,
    __version__,
    check_integrator,
    compare,
    compile_shader,
    convert_rib,
    delta_e_2000,
    emit_shader,
    glass,
    illuminant_names,
    integrators,
    load,
    metal,
    publish_shader,
    published_metadata,
    read,
    render,
    shader_cache_clear,
    shader_cache_entries,
    shader_cache_folder,
    shader_cache_limit,
    shader_cache_trim,
    shader_stages,
    z_test,
)
from .graph import GraphError, ShaderGraph

__all__ = [
    "Camera",
    "Comparison",
    "CompiledShader",
    "Error",
    "GraphError",
    "Group",
    "Journal",
    "Material",
    "Message",
    "Options",
    "Picture",
    "Scene",
    "Shader",
    "ShaderGraph",
    "Spectrum",
    "ZTestResult",
    "__version__",
    "check_integrator",
    "compare",
    "compile_shader",
    "convert_rib",
    "delta_e_2000",
    "emit_shader",
    "glass",
    "illuminant_names",
    "integrators",
    "load",
    "metal",
    "publish_shader",
    "published_metadata",
    "read",
    "render",
    "shader_cache_clear",
    "shader_cache_entries",
    "shader_cache_folder",
    "shader_cache_limit",
    "shader_cache_trim",
    "shader_stages",
    "z_test",
]
