#include "ri/predeclared.h"

#include <algorithm>

namespace kanuka::ri {

namespace {

struct Row {
    std::string_view request, group; // "*": any
    std::string_view declaration;
    std::string_view names; // separated by spaces
};

// As the manuals of PRMan, Aqsis, 3Delight and BMRT have them; where they differ, as most do. What is alike
// in all requests stands in ingest/rib/declarations.cpp, where RIB finds it too.
constexpr Row Rows[] = {
    {"Option", "shadow", "uniform float", "bias bias0 bias1"},
    {"Option", "limits", "uniform color", "zthreshold othreshold"},
    {"Option", "limits", "uniform integer",
     "threads nthreads octreememory pointmemory brickmemory deepshadowmemory deepshadowtiles "
     "curvemaxsegments"},
    {"Option", "limits", "uniform float", "vprelativeshadingrate"},
    {"Option", "render", "uniform integer", "minsamples maxsamples nthreads prmanspecular prmanlighting"},
    {"Option", "render", "uniform float", "minshadowbias"},
    {"Option", "render", "uniform string", "bucketorder"},
    {"Option", "radiosity", "uniform integer", "steps minpatchsamples"},
    {"Option", "statistics", "uniform string", "filename xmlfilename stylesheet"},
    {"Option", "statistics", "uniform integer", "progress level"},
    {"Option", "searchpath", "uniform string", "resource dirmap rslplugin rixplugin"},
    {"Option", "rib", "uniform string", "format asciistyle compression verbosity"},
    {"Option", "rib", "uniform integer", "precision pipe"},
    {"Option", "RI2RIB_Output", "uniform string", "Type Compression"},
    {"Option", "RI2RIB_Output", "uniform integer", "PipeHandle"},
    {"Option", "RI2RIB_Indentation", "uniform string", "Type"},
    {"Option", "RI2RIB_Indentation", "uniform integer", "Size"},
    {"Option", "bucket", "uniform string", "order"},
    {"Option", "runtime", "uniform string", "verbosity"},
    {"Option", "shutter", "uniform float", "offset"},
    {"Option", "trace", "uniform float", "approximation decimationrate"},
    {"Option", "ribparse", "uniform string", "varsubst"},
    {"Option", "photon", "uniform integer", "emit lifetime"},
    {"Option", "shadow", "uniform string", "shadowmap_mode"},

    {"Attribute", "displacementbound", "uniform string", "space CoordinateSystem"},
    {"Attribute", "trace", "uniform float", "bias decimationrate"},
    {"Attribute", "trace", "uniform integer", "displacements samplemotion maxsubsurfacedepth"},
    {"Attribute", "visibility", "uniform integer",
     "diffuse specular transmission photon trace indirect subsurface midpoint"},
    {"Attribute", "shade", "uniform string",
     "camerahitmode diffusehitmode specularhitmode transmissionhitmode strategy volumeintersectionstrategy"},
    {"Attribute", "shade", "uniform float", "relativeshadingrate"},
    {"Attribute", "dice", "uniform integer", "binary rasterorient hair roundcurve strict"},
    {"Attribute", "dice", "uniform float", "minlength"},
    {"Attribute", "dice", "uniform string", "minlengthspace"},
    {"Attribute", "cull", "uniform integer", "hidden backfacing"},
    {"Attribute", "derivatives", "uniform integer", "centered extrapolate"},
    {"Attribute", "stochastic", "uniform integer", "sigma pointfalloff"},
    {"Attribute", "irradiance", "uniform float", "maxerror maxpixeldist"},
    {"Attribute", "irradiance", "uniform integer", "nsamples"},
    {"Attribute", "irradiance", "uniform string", "handle filemode"},
    {"Attribute", "photon", "uniform string", "shadingmodel globalmap causticmap"},
    {"Attribute", "photon", "uniform integer", "estimator"},
    {"Attribute", "sides", "uniform integer", "doubleshaded"},
    {"Attribute", "sides", "uniform float", "backfacetolerance"},
    {"Attribute", "light", "uniform integer", "samples nsamples"},
    {"Attribute", "light", "uniform string", "shadow emitphotons"},
    {"Attribute", "identifier", "uniform string", "object"},
    {"Attribute", "render", "uniform string", "visibility"},
    {"Attribute", "render", "uniform float", "patch_multiplier"},
    {"Attribute", "render", "uniform integer", "patch_maxlevel patch_minlevel"},
    {"Attribute", "radiosity", "uniform color", "averagecolor emissioncolor"},
    {"Attribute", "radiosity", "uniform float", "patchsize elemsize minsize"},
    {"Attribute", "radiosity", "uniform string", "zonal"},
    {"Attribute", "grouping", "uniform string", "membership tracegroup"},
    {"Attribute", "autoshadows", "uniform string", "shadowmapname"},
    {"Attribute", "autoshadows", "uniform integer", "res"},
    {"Attribute", "shadow", "uniform float", "bias bias0 bias1"},
    {"Attribute", "procedural", "uniform integer", "reentrant immediatesubdivide"},
    {"Attribute", "stitch", "uniform integer", "enable"},

    {"Hider", "*", "uniform integer",
     "jitter samplemotion extrememotiondof incremental minsamples maxsamples sigma pointfalloff maxvpdepth "
     "emit subpixel"},
    {"Hider", "*", "uniform float", "minwidth sigmablur"},
    {"Hider", "*", "uniform float[4]", "aperture"},
    {"Display", "*", "uniform integer", "merge"},
    {"Display", "*", "uniform float[2]", "filterwidth exposure resolution"},
    {"Display", "*", "uniform float", "gain gamma"},
    {"Display", "*", "uniform string", "filter compression interpretation resolutionunit"},
    {"DisplayChannel", "*", "uniform float[2]", "filterwidth exposure"},
    {"DisplayChannel", "*", "uniform string", "filter interpretation"},
};

bool holds(std::string_view names, std::string_view name) {
    for (size_t at = 0; at < names.size();) {
        const size_t stop = std::min(names.find(' ', at), names.size());
        if (names.substr(at, stop - at) == name)
            return true;
        at = stop + 1;
    }
    return false;
}

} // namespace

std::string_view predeclared(std::string_view request, std::string_view group, std::string_view name) {
    for (const Row& row : Rows)
        if (row.request == request && (row.group == "*" || row.group == group) && holds(row.names, name))
            return row.declaration;
    return {};
}

std::string_view predeclared_elsewhere(std::string_view name) {
    for (const Row& row : Rows)
        if (holds(row.names, name))
            return row.declaration;
    return {};
}

} // namespace kanuka::ri
