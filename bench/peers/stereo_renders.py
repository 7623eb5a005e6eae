"""Rendered stereo pairs whose disparities are known exactly: slanted planes one in front of the other.

Every scene is drawn at random from a seed: textures of several scales and contrasts, walls with next to none, stripes
that repeat, noise, and another brightness of the right camera.
"""
import numpy as np
from scipy import ndimage

SAMPLES = 3  # samples of a pixel, along each axis


def texture(rng, width, height, kind):
    """Brightness over twice as many samples as pixels, to be looked up between them."""
    shape = (2 * height + 64, 2 * width + 512)
    if kind == "blank":
        contrast, scales = rng.uniform(0.0, 1.0), (8, 32)
    else:
        contrast, scales = np.exp(rng.uniform(np.log(4.0), np.log(45.0))), (2, 4, 8, 16, 64)
    field = np.zeros(shape)
    for scale in scales:
        coarse = rng.normal(size=(shape[0] // scale + 3, shape[1] // scale + 3))
        fine = ndimage.zoom(coarse, scale, order=3 if scale < 16 else 1)[: shape[0], : shape[1]]
        field += rng.uniform(0.2, 1.0) * fine
    field *= contrast / field.std()
    if kind == "stripes":
        field = 0.2 * field + 35.0 * np.sin(np.arange(shape[1]) * np.pi / rng.uniform(6.0, 20.0))
    return field + rng.uniform(70.0, 180.0)


class Layer:
    def __init__(self, rng, size, disparities, kind, whole):
        width, height = size
        self.texture = texture(rng, width, height, kind)
        self.whole = whole
        low, high = disparities
        self.centre = rng.uniform(0.0, width), rng.uniform(0.0, height)
        self.radii = rng.uniform(0.06, 0.3) * width, rng.uniform(0.06, 0.3) * height
        self.corners = rng.choice([2.0, 2.0, 20.0])  # an ellipse, or all but a rectangle
        most = 0.05 if whole else 0.15
        self.slopes = rng.uniform(-most, most, 2)
        self.disparity = rng.uniform(low, high)

    def plane(self, x, y):
        return self.disparity + self.slopes[0] * (x - self.centre[0]) + self.slopes[1] * (y - self.centre[1])

    def covers(self, x, y):
        u, v = (x - self.centre[0]) / self.radii[0], (y - self.centre[1]) / self.radii[1]
        return np.ones_like(x, bool) if self.whole else np.abs(u) ** self.corners + np.abs(v) ** self.corners < 1.0

    def left_of(self, x_right, y):
        """Where the left camera sees what the right one sees at x."""
        constant = self.disparity - self.slopes[0] * self.centre[0] + self.slopes[1] * (y - self.centre[1])
        return (x_right + constant) / (1.0 - self.slopes[0])

    def brightness(self, x, y):
        return ndimage.map_coordinates(self.texture, [2.0 * y + 32.0, 2.0 * x + 256.0], order=1, mode="nearest")


def look(layers, x, y, right):
    """The layer that is seen at each place, and where the left camera sees it."""
    nearest, seen, at = np.full(x.shape, -np.inf), np.zeros(x.shape, int), x.copy()
    for number, layer in enumerate(layers):
        left = layer.left_of(x, y) if right else x
        disparity = layer.plane(left, y)
        front = layer.covers(left, y) & (disparity > nearest)
        nearest, seen, at = np.where(front, disparity, nearest), np.where(front, number, seen), np.where(front, left, at)
    return seen, at, nearest


def picture(layers, size, right):
    width, height = size
    offsets = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    x = (np.arange(width)[:, None] + offsets).ravel()
    y = (np.arange(height)[:, None] + offsets).ravel()
    x, y = (a.astype(float) for a in np.meshgrid(x, y))
    seen, at, _ = look(layers, x, y, right)
    grey = np.zeros(x.shape)
    for number, layer in enumerate(layers):
        here = seen == number
        grey[here] = layer.brightness(at[here], y[here])
    return grey.reshape(height, SAMPLES, width, SAMPLES).mean((1, 3))


def pair(seed, size=(400, 300), most=64):
    """Left and right (8 bits), disparities of the left pixels, and which of them the right camera sees."""
    rng = np.random.default_rng(seed)
    kinds = rng.choice(["noise", "noise", "noise", "blank", "stripes"], 8)
    kinds[0] = "blank" if seed % 8 == 7 else "noise"
    layers = [Layer(rng, size, (6.0 + 0.1 * most, 0.25 * most), kinds[0], True)]
    layers += [Layer(rng, size, (0.3 * most, 0.75 * most), kind, False) for kind in kinds[1:]]
    left, right = (picture(layers, size, right) for right in (False, True))
    noise, gain = rng.uniform(0.5, 3.0), rng.normal(1.0, 0.05)
    right = 128.0 + gain * (right - 128.0) + rng.normal(0.0, 4.0)
    blur = rng.uniform(0.0, 0.7)
    left, right = (ndimage.gaussian_filter(p, blur) for p in (left, right))
    left, right = (np.clip(np.rint(p + rng.normal(0.0, noise, p.shape)), 0, 255).astype(np.uint8) for p in (left, right))
    x, y = (a.astype(float) for a in np.meshgrid(np.arange(size[0]), np.arange(size[1])))
    seen, _, disparity = look(layers, x, y, False)
    there, _, _ = look(layers, x - disparity, y, True)
    visible = (there == seen) & (x - disparity >= 0.0) & (x - disparity <= size[0] - 1)
    return left, right, disparity.astype(np.float32), visible
