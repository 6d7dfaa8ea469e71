"""Mitsuba's microfacets, scaled to what Kanuka's are by design, so that what is left to differ is a mistake.

Mitsuba multiplies Smith's terms of the two directions, as if heights there were independent; Kanuka's are those of one
height field (Heitz 2014, eq. 99). Mitsuba loses what meets several facets; Kanuka gives it back, and below a rough coat
what it does not reflect is the paint's (balance.py, which shares nothing with its tables).
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from peers import balance

NAME = "kanuka_facets"
SPREAD = {"glass": 0.25, "coat": 0.5}  # part of samples that are of a cosine: light of several facets, and paint


class Facets(mi.BSDF):
    """`facets`: Mitsuba's own lobe; `lossless`: "", metal, glass, or coat, whose paint has `reflectance`."""

    def __init__(self, props: mi.Properties) -> None:
        mi.BSDF.__init__(self, props)
        self.facets = props["facets"]
        self.slopes, self.alpha, self.lossless = props["slopes"], props["alpha"], props["lossless"]
        spectra, ior = props["spectra"], props["ior"]
        self.m_components = [self.facets.flags(i) for i in range(self.facets.component_count())]
        self.m_flags = self.facets.flags()
        if self.lossless == "metal":
            _, s, mean = balance.of_mirror(self.alpha)
            self.sides = [self._table(s)]
            nm, n, k = np.loadtxt(spectra)
            F = balance.mean_fresnel(n, k)
            self.first_nm, self.gain = float(nm[0]), mi.Float(F * mean / (1 - F * (1 - mean)))
        elif self.lossless == "glass":
            self.ior, self.glass = ior, balance.Glass(self.alpha, ior)
            self.sides = [self._table(loss) for loss in self.glass.loss]
        elif self.lossless == "coat":
            coat = balance.Coat(self.alpha, ior)
            self.ior, self.kept, self.paint = ior, coat.kept, props.get_texture("reflectance")
            self.sides = [self._table(coat.through)]

    @staticmethod
    def _table(s: np.ndarray) -> mi.Float:
        """By evenly spaced angles from the normal."""
        theta = np.arccos(balance.Sphere().cosine)
        return mi.Float(np.interp(np.linspace(0, np.pi / 2, 257), theta, s))

    @staticmethod
    def _look_up(table: mi.Float, x: mi.Float) -> mi.Float:
        x = dr.clip(x, 0, dr.width(table) - 1.001)
        at = mi.UInt32(x)
        a, b = dr.gather(mi.Float, table, at), dr.gather(mi.Float, table, at + 1)
        return a + (x - at) * (b - a)

    def _at(self, w: mi.Vector3f) -> mi.Float:
        """s of metal, the loss of glass, what a coat lets through."""
        x = dr.acos(dr.clip(dr.abs(w.z), 0, 1)) * (256 * 2 / dr.pi)
        outside = self._look_up(self.sides[0], x)
        return outside if len(self.sides) == 1 else dr.select(w.z > 0, outside, self._look_up(self.sides[1], x))

    def _lambda(self, w: mi.Vector3f) -> mi.Float:
        cosine2 = dr.maximum(dr.square(w.z), 1e-12)
        tangent = dr.sqrt(dr.maximum(1 - cosine2, 0) / cosine2)
        if self.slopes == "ggx":
            return 0.5 * (dr.sqrt(1 + dr.square(self.alpha * tangent)) - 1)
        a = dr.minimum(1 / (self.alpha * dr.maximum(tangent, 1e-6)), 20)
        return 0.5 * (dr.erf(a) - 1) + dr.exp(-a * a) / (2 * a * dr.sqrt(dr.pi))

    def _scale(self, si: mi.SurfaceInteraction3f, wo: mi.Vector3f) -> mi.Spectrum:
        """Correlated over separate, the separate ones as Mitsuba rounds them; then what several facets give back."""
        facets = mi.MicrofacetDistribution(
            mi.MicrofacetType.GGX if self.slopes == "ggx" else mi.MicrofacetType.Beckmann, self.alpha
        )

        def separate(w: mi.Vector3f) -> mi.Float:
            return facets.smith_g1(mi.Vector3f(w.x, w.y, dr.abs(w.z)), mi.Vector3f(0, 0, 1))

        both = 1 / (1 + self._lambda(si.wi) + self._lambda(wo))
        scale = mi.Spectrum(both / dr.maximum(separate(si.wi) * separate(wo), 1e-20))
        if self.lossless == "metal":
            more = self._at(si.wi) * self._at(wo) - 1
            for i in range(len(scale)):
                scale[i] *= 1 + self._look_up(self.gain, si.wavelengths[i] - self.first_nm) * more
        return scale

    def _more(self, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: mi.Bool) -> mi.Spectrum:
        """Beside one facet: what several of glass send on, or paint below a coat."""
        both = self._at(si.wi) * self._at(wo) * dr.abs(wo.z)
        if self.lossless == "coat":
            paint = self.paint.eval(si, active)
            return dr.select(
                (si.wi.z > 0) & (wo.z > 0), both * paint / (1 - paint * self.kept) / (dr.pi * self.ior**2), 0
            )
        # Radiance that passes goes with the square of the index here.
        back, across = self.glass.back, self.glass.across
        outside, passes = si.wi.z > 0, si.wi.z * wo.z < 0
        stays = dr.select(outside, back[0], back[1])
        goes = dr.select(outside, across[0] / self.ior**2, across[1] * self.ior**2)
        return mi.Spectrum(both * dr.select(passes, goes, stays))

    def sample(self, ctx, si, sample1, sample2, active=True):
        if self.lossless not in SPREAD:
            sampled, weight = self.facets.sample(ctx, si, sample1, sample2, active)
            return sampled, weight * self._scale(si, sampled.wo)
        part, glass = SPREAD[self.lossless], self.lossless == "glass"
        spread = sample1 < part
        again = dr.select(spread, sample1 / part, (sample1 - part) / (1 - part))
        sampled, weight = self.facets.sample(ctx, si, again, sample2, active)
        valid = active & (spread | (dr.max(weight) > 0))  # not those that leave on the wrong side
        w = mi.warp.square_to_cosine_hemisphere(sample2)
        if glass:
            w.z = dr.select(again < 0.5, w.z, -w.z)
            passes = si.wi.z * dr.select(spread, w.z, sampled.wo.z) < 0
            sampled.eta = dr.select(passes, dr.select(si.wi.z > 0, self.ior, 1 / self.ior), 1)
        sampled.wo = dr.select(spread, w, sampled.wo)
        sampled.pdf = self.pdf(ctx, si, sampled.wo, active)
        value = self.eval(ctx, si, sampled.wo, active)
        return sampled, dr.select(valid & (sampled.pdf > 0), value / sampled.pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        value = self.facets.eval(ctx, si, wo, active) * self._scale(si, wo)
        return value + self._more(si, wo, active) if self.lossless in SPREAD else value

    def pdf(self, ctx, si, wo, active=True):
        pdf = self.facets.pdf(ctx, si, wo, active)
        if self.lossless not in SPREAD:
            return pdf
        part, cosine = SPREAD[self.lossless], wo.z / dr.pi
        spread = dr.abs(cosine) / 2 if self.lossless == "glass" else dr.maximum(cosine, 0)
        return (1 - part) * pdf + part * spread

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self) -> str:
        return f"Facets[{self.facets}]"


mi.register_bsdf(NAME, Facets)
