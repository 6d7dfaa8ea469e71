// Quads with a picture: where it is brighter than its mean, places are drawn by it; the rest goes by solid
// angle. One sample takes either way, and its density is that of both.
#pragma once

#include "transport/light_shapes.h"

namespace kanuka::transport {

// In LightsView::densities, at AnalyticLight::picture; the tables of PictureCells behind it. Columns of
// cells are one more than those of texels, for at the borders the outermost texels go on.
struct QuadDensity {
    enum Word { Share = 0, Density = 1, Mean = 2, Words = 3 };
};

template <int W>
struct QuadPicture {
    using F = Float<W>;
    using I = Int<W>;
    using A = AnalyticLight;
    const SceneView& scene;
    I table, columns, rows, marginal, conditional;
    F width, height, share, density, mean;

    QuadPicture(const SceneView& scene, const LightLanes<W>& light, Mask<W> m) : scene(scene) {
        const I at = select(m, light.get(&A::picture), I(0));
        table = select(m, light.get(&A::table), I(0));
        columns = select(m, light.get(&A::width), I(1)) + I(1),
        rows = select(m, light.get(&A::height), I(1)) + I(1);
        width = F(columns - I(1)), height = F(rows - I(1));
        const float* words = scene.lights.densities.data();
        share = gather(words + QuadDensity::Share, at);
        density = gather(words + QuadDensity::Density, at);
        mean = gather(words + QuadDensity::Mean, at);
        marginal = at + I(QuadDensity::Words);
        conditional = marginal + rows + I(1);
    }

    // Over area, at a place from -1 to 1.
    F pdf(const Vec3<F>& place) const {
        F x, y;
        const I i = cell(fma(place.x, F(0.5f), F(0.5f)) * width, columns, x),
                j = cell(fma(place.y, F(-0.5f), F(0.5f)) * height, rows, y);
        return weights(i, j).at(x, y) * density;
    }
    Vec3<F> sample(F u0, F u1) const {
        const float* words = scene.lights.densities.data();
        const I j = search(words, marginal, rows, u1), row = conditional + j * (columns + I(1));
        const I i = search(words, row, columns, u0);
        F x, y;
        weights(i, j).sample(within_step(words, row + i, u0), within_step(words, marginal + j, u1), x, y);
        return {fma(along(i, columns, x) / width, F(2.0f), F(-1.0f)),
                fma(along(j, rows, y) / height, F(-2.0f), F(1.0f)), F(0.0f)};
    }

  private:
    BilinearCell<W> weights(I i, I j) const {
        const I zero(0), one(1), w = columns - one;
        const I is[2] = {max(i - one, zero), min(i, w - one)},
                js[2] = {max(j - one, zero), min(j, rows - I(2))};
        BilinearCell<W> c;
        for (int b = 0; b < 2; b++)
            for (int a = 0; a < 2; a++) {
                const I at = table + (js[b] * w + is[a]) * I(3);
                const float* rgb = scene.lights.tables.data();
                c.w[b][a] =
                    above_mean(texel_weight(gather(rgb, at), gather(rgb + 1, at), gather(rgb + 2, at)), mean);
            }
        return c;
    }
    // Cells begin at 0, 1/2, 3/2, …
    static I cell(F x, I count, F& within) {
        const F half(0.5f), from = floor(x + half);
        const I i = min(max(to_int(from), I(0)), count - I(1));
        const Mask<W> first = i == I(0), last = i == count - I(1);
        within = clamp(select(first, x + x, select(last, (x + half - from) * F(2.0f), x + half - from)),
                       F(0.0f), F(1.0f));
        return i;
    }
    static F along(I i, I count, F within) {
        const F half(0.5f);
        const Mask<W> narrow = (i == I(0)) | (i == count - I(1));
        return max(F(i) - half, F(0.0f)) + within * select(narrow, half, F(1.0f));
    }
};

template <int W>
Mask<W> has_picture(const SceneView& scene, const LightLanes<W>& light, Mask<W> m) {
    return scene.lights.densities.empty() ? Mask<W>(false)
                                          : m & (light.get(&AnalyticLight::picture) >= Int<W>(0));
}

// As sample_shape() and intersect_shape().
template <int W>
LightPoint<W> sample_quad(const SceneView& scene, const LightLanes<W>& light, const Vec3<Float<W>>& P,
                          Float<W> u0, Float<W> u1, Mask<W> m) {
    using F = Float<W>;
    using A = AnalyticLight;
    const Mask<W> pictured = has_picture(scene, light, m);
    if (!any(pictured))
        return sample_shape(A::Quad, light, P, u0, u1, m);
    const QuadPicture<W> picture(scene, light, pictured);
    const F one(1.0f), share = picture.share;
    const Mask<W> chosen = pictured & (u0 < share);
    const F rest = select(chosen, u0 / max(share, F(1e-6f)), (u0 - share) / (one - share));
    LightPoint<W> s =
        sample_shape(A::Quad, light, P, select(pictured, clamp(rest, F(0.0f), F(0.99999994f)), u0), u1, m);
    if (any(chosen)) {
        const Vec3<F> place = picture.sample(clamp(rest, F(0.0f), F(0.99999994f)), u1);
        const Vec3<F> v = light.to_light(light.get(&A::position) - P) +
                          Vec3<F>(place.x * light.get(&A::half_x), place.y * light.get(&A::half_y), F(0.0f));
        const F d2 = max(dot(v, v), F(1e-30f)), d = sqrt(d2), cosine = -v.z / d;
        s.place = select(chosen, place, s.place);
        s.wi = select(chosen, normalize(light.to_render(v)), s.wi);
        s.distance = select(chosen, d, s.distance);
        s.cosine = select(chosen, cosine, s.cosine);
        s.pdf_solid_angle = select(
            chosen, QuadView<W>(light, P, chosen).pdf(d2, -cosine, light.get(&A::area)), s.pdf_solid_angle);
        s.valid = (s.valid & !chosen) | (chosen & (cosine > F(1e-6f)));
    }
    const F by_picture = picture.pdf(s.place) * s.distance * s.distance / max(s.cosine, F(1e-6f));
    s.pdf_solid_angle =
        select(pictured, fma(share, by_picture - s.pdf_solid_angle, s.pdf_solid_angle), s.pdf_solid_angle);
    return s;
}

template <int W>
LightPoint<W> intersect_quad(const SceneView& scene, const LightLanes<W>& light, const Vec3<Float<W>>& P,
                             const Vec3<Float<W>>& wi, Mask<W> m) {
    using F = Float<W>;
    LightPoint<W> s = intersect_shape(AnalyticLight::Quad, light, P, wi, m);
    const Mask<W> pictured = has_picture(scene, light, s.valid);
    if (!any(pictured))
        return s;
    const QuadPicture<W> picture(scene, light, pictured);
    const F cosine = max(-dot(light.get(&AnalyticLight::axis), wi), F(1e-6f));
    const F by_picture = picture.pdf(s.place) * s.distance * s.distance / cosine;
    s.pdf_solid_angle = select(
        pictured, fma(picture.share, by_picture - s.pdf_solid_angle, s.pdf_solid_angle), s.pdf_solid_angle);
    return s;
}

} // namespace kanuka::transport
