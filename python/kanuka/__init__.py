"""Kanuka, a production renderer that shades before it traces.

import kanuka

scene = kanuka.Scene()
scene.camera = kanuka.Camera(origin=(0, 1, 5), target=(0, 0, 0), fov=40)
scene.add_mesh(points, faces, material=kanuka.Material("matte", color=(0.8, 0.2, 0.1)))
scene.add_light("distant", amount=3, direction=(-1, -1, -1))
picture = kanuka.render(scene, progressions=64)
picture.write("picture.exr")
"""

from importlib import import_module as _module
from typing import TYPE_CHECKING

try:
    from ._native import __version__
except ImportError as error:
    from .system_libraries import explained

    raise explained(error) from error

from ._native import (
    Camera,
    Checkpoint,
    Comparison,
    CompiledShader,
    Error,
    Expansions,
    Group,
    Journal,
    Lobe,
    Material,
    Message,
    Node,
    Options,
    Picture,
    ProceduralRequest,
    Scene,
    Session,
    Shader,
    Solid,
    Spectrum,
    ZTestResult,
    attribute_parameters,
    camera_parameters,
    check_integrator,
    check_layer,
    check_option,
    checkpoint_info,
    compare,
    compile_shader,
    convert_rib,
    decimate,
    delta_e_2000,
    emit_shader,
    frames,
    glass,
    illuminant_names,
    integrators,
    light_kinds,
    load,
    load_camera,
    lobe_names,
    make_texture,
    merge,
    metal,
    option_parameters,
    picture_file,
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
    store_compress,
    store_packs,
    store_prune,
    surface_mesh,
    texture_cache_files,
    texture_cache_folder,
    texture_cache_limit,
    texture_cache_prune,
    traced_surfaces,
    write_oracle,
    z_test,
)
from .messages import Warning
from .paths import include_dir, library_dir, standard_shaders

if TYPE_CHECKING:
    from .graph import GraphError, ShaderGraph
    from .procedurals import procedural

__all__ = [
    "Camera",
    "Checkpoint",
    "Comparison",
    "CompiledShader",
    "Error",
    "Expansions",
    "GraphError",
    "Group",
    "Journal",
    "Lobe",
    "Material",
    "Message",
    "Node",
    "Options",
    "Picture",
    "ProceduralRequest",
    "Scene",
    "Session",
    "Shader",
    "ShaderGraph",
    "Solid",
    "Spectrum",
    "Warning",
    "ZTestResult",
    "__version__",
    "attribute_parameters",
    "camera_parameters",
    "check_integrator",
    "check_layer",
    "check_option",
    "checkpoint_info",
    "compare",
    "compile_shader",
    "convert_rib",
    "decimate",
    "delta_e_2000",
    "emit_shader",
    "frames",
    "glass",
    "illuminant_names",
    "include_dir",
    "integrators",
    "library_dir",
    "light_kinds",
    "load",
    "load_camera",
    "lobe_names",
    "make_texture",
    "merge",
    "metal",
    "option_parameters",
    "picture_file",
    "procedural",
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
    "standard_shaders",
    "store_compress",
    "store_packs",
    "store_prune",
    "surface_mesh",
    "texture_cache_files",
    "texture_cache_folder",
    "texture_cache_limit",
    "texture_cache_prune",
    "traced_surfaces",
    "write_oracle",
    "z_test",
]

# What few programs need, by the modules that have it: with what these import it takes a fifth of the time of all.
_LATER = {"graph": ("GraphError", "ShaderGraph"), "procedurals": ("procedural",)}


def __getattr__(name: str) -> object:
    for module, names in _LATER.items():
        if name == module or name in names:
            found = _module(f".{module}", __name__)
            return found if name == module else globals().setdefault(name, getattr(found, name))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_LATER})
