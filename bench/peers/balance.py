"""What lossless microfacets give back (docs/transport.md, "What loses light"), by quadrature in double.

Of metals s of Sinkhorn's balance: the lobe of one facet times s(wo) s(wi) reflects all there is. Of glass what one
facet loses, by direction, and what leaves to either side by a lobe of its own. Of a coat over paint what it lets
through, and what comes back to the paint from inside. Shares nothing with the renderer's
tables: directions are Gauss-Legendre nodes of angles, kernels are integrated over the azimuth. NumPy alone.
"""

from __future__ import annotations

import numpy as np

NODES, AZIMUTHS = 128, 256


def _nodes(count: int, end: float) -> tuple[np.ndarray, np.ndarray]:
    x, w = np.polynomial.legendre.leggauss(count)
    return (x + 1) / 2 * end, w / 2 * end


def _lambda(cosine: np.ndarray, alpha: float) -> np.ndarray:
    tangent2 = (1 - cosine**2) / np.maximum(cosine**2, 1e-12)
    return 0.5 * (np.sqrt(1 + alpha**2 * tangent2) - 1)


def _ggx(cosine: np.ndarray, alpha: float) -> np.ndarray:
    c2 = cosine**2
    return alpha**2 / (np.pi * (c2 * (alpha**2 - 1) + 1) ** 2)


def fresnel(cosine: np.ndarray, eta: float) -> np.ndarray:
    """Of a dielectric; eta: index behind over index before."""
    t2 = 1 - (1 - cosine**2) / eta**2
    t = np.sqrt(np.maximum(t2, 0))
    s, p = (cosine - eta * t) / (cosine + eta * t), (eta * cosine - t) / (eta * cosine + t)
    return np.where(t2 > 0, (s**2 + p**2) / 2, 1.0)


class Sphere:
    """Pairs of directions: from the left cosine, azimuth 0, to the right cosine and an azimuth."""

    def __init__(self) -> None:
        theta, weight = _nodes(NODES, np.pi / 2)
        self.cosine, self.sine = np.cos(theta), np.sin(theta)
        self.solid = self.sine * weight  # of a ring, over 2 pi
        x, w = _nodes(AZIMUTHS, 1.0)
        self.phi, self.phi_weight = np.pi * x**2, 2 * np.pi * x * w * 2  # both halves; dense about the mirror

    def reflected(self, alpha: float, eta: float) -> np.ndarray:
        """∫ f cos over azimuths; eta = 0: of a mirror."""
        found = np.empty((NODES, NODES))
        for i, (c, s) in enumerate(zip(self.cosine, self.sine, strict=True)):
            x, y, z = s + self.sine[:, None] * np.cos(self.phi), self.sine[:, None] * np.sin(self.phi), c + self.cosine
            length = np.sqrt(x**2 + y**2 + z[:, None] ** 2)
            shadow = 1 + _lambda(c, alpha) + _lambda(self.cosine, alpha)[:, None]
            f = _ggx(z[:, None] / length, alpha) / (4 * c * shadow)
            if eta:
                f = f * fresnel(length / 2, eta)  # cosine of the facet: |wo + wi| / 2
            found[i] = f @ self.phi_weight
        return found

    def transmitted(self, alpha: float, eta: float) -> np.ndarray:
        """Walter et al. 2007, eq. 21, as light's energy goes: without the eta² of radiance."""
        found = np.empty((NODES, NODES))
        for i, (c, s) in enumerate(zip(self.cosine, self.sine, strict=True)):
            wi = (
                self.sine[:, None] * -np.cos(self.phi),
                self.sine[:, None] * np.sin(self.phi),
                -self.cosine[:, None] + 0 * self.phi,
            )
            half = [s + eta * wi[0], eta * wi[1], c + eta * wi[2]]
            length = np.sqrt(sum(h**2 for h in half))
            sign = np.sign(half[2])
            m = [sign * h / length for h in half]
            om, im = m[0] * s + m[2] * c, sum(a * b for a, b in zip(m, wi, strict=True))
            q = om + eta * im
            jacobian = om * np.abs(im) * eta**2 / np.maximum(q**2, 1e-30)
            shadow = 1 + _lambda(c, alpha) + _lambda(self.cosine, alpha)[:, None]
            f = _ggx(m[2], alpha) / (c * shadow) * jacobian * (1 - fresnel(np.maximum(om, 0), eta))
            found[i] = np.where((om > 0) & (im < 0), f, 0) @ self.phi_weight
        return found


def _balanced(kernel: np.ndarray, rounds: int = 200) -> np.ndarray:
    """s with s (kernel s) = 1."""
    s = np.ones(len(kernel))
    for _ in range(rounds):
        s = np.sqrt(s / (kernel @ s))
    return s


def of_mirror(alpha: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Cosines, s, and the mean albedo of one facet."""
    sphere = Sphere()
    kernel = sphere.reflected(alpha, 0) * sphere.solid
    mean = float(2 * (kernel.sum(1) * sphere.cosine) @ sphere.solid)
    return sphere.cosine, _balanced(kernel), mean


def _mean(sphere: Sphere, f: np.ndarray) -> float:
    return float(2 * (f * sphere.cosine) @ sphere.solid)


class Glass:
    """Losses outside and inside, and what several facets send: f = loss(wo) loss(wi) back[side] or across[side]."""

    def __init__(self, alpha: float, ior: float) -> None:
        sphere = Sphere()
        self.loss, eta = [], (ior, 1 / ior)
        for n in eta:
            once = (sphere.reflected(alpha, n) + sphere.transmitted(alpha, n)) * sphere.solid
            self.loss.append(np.maximum(1 - once.sum(1), 0))
        mean = [_mean(sphere, loss) for loss in self.loss]
        passes = 1 - _mean(sphere, fresnel(sphere.cosine, ior))
        self.back, self.across = [], []
        for here, n in enumerate(eta):
            below = passes * min(1.0, n**2 * mean[1 - here] / mean[here])
            self.back.append((1 - below) / (np.pi * mean[here]))
            self.across.append(below / (np.pi * mean[1 - here]))


class Coat:
    """Over paint of albedo a: a / (pi n^2 (1 - a kept)) times `through` of both directions.

    What one facet does not reflect goes through; by reciprocity the same part of diffuse light from inside gets out.
    """

    def __init__(self, alpha: float, ior: float) -> None:
        sphere = Sphere()
        once = sphere.reflected(alpha, ior) * sphere.solid
        self.through = 1 - once.sum(1)
        self.kept = 1 - _mean(sphere, self.through) / ior**2


def mean_fresnel(n: np.ndarray, k: np.ndarray) -> np.ndarray:
    """Of metals, over directions: 2 ∫ F cos."""
    theta, weight = _nodes(64, np.pi / 2)
    c, s2 = np.cos(theta)[:, None], np.sin(theta)[:, None] ** 2
    inner = np.sqrt((n + 1j * k) ** 2 - s2)
    rs = np.abs((c - inner) / (c + inner)) ** 2
    rp = np.abs(((n + 1j * k) ** 2 * c - inner) / ((n + 1j * k) ** 2 * c + inner)) ** 2
    return 2 * ((rs + rp) / 2 * c * np.sin(theta)[:, None] * weight[:, None]).sum(0)
