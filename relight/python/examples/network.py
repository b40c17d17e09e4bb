"""The network of `relight weights export -o relight.onnx` with nothing but onnxruntime and NumPy."""

import numpy as np
import onnxruntime


def encode(image, mask):
    """image: rows x columns x 3, linear, the object resized to 128 x 128 (sides are multiples of 32); mask: bool.
    What the network takes, and the light of its 1."""
    white = max(np.sort(image.max(2)[mask])[int(0.99 * mask.sum())], 1e-6)
    light = np.clip(image / white, 0, 1.5)
    mean = light.mean(2, keepdims=True)
    chroma = 4 * (light[..., :2] - mean) / (3 * mean + 0.03)
    log = (np.log(mean + 0.01) + 2) / 2
    planes = np.concatenate([2 * light ** (1 / 2.2) - 1, np.ones_like(mean), log, chroma], 2) * mask[..., None]
    return np.float32(planes.transpose(2, 0, 1)[None]), white


def network_maps(session, image, mask):
    """Normals (x right, y up, z to the viewer), albedo, shading and highlight (linear), light (9 coefficients)."""
    sigmoid = lambda v: 1 / (1 + np.exp(-v))
    softplus = lambda v: np.maximum(v, 0) + np.log1p(np.exp(-np.abs(v)))
    planes, white = encode(image, mask)
    maps, light = session.run(["maps", "light"], {"input": planes})
    x, y, z, red, green, blue, highlight, offset, share = maps[0]
    normals = np.stack([x, y, softplus(z) + 0.02], 2)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    albedo = sigmoid(np.stack([red, green, blue], 2))
    shading = np.exp(np.clip(offset + sigmoid(share) * (2 * planes[0, 4] - 2), -6, 3))
    found = [normals, albedo, shading, white * softplus(highlight - 3.5)]
    return [plane * (mask[..., None] if plane.ndim == 3 else mask) for plane in found] + [light[0]]


if __name__ == "__main__":
    grey = np.full((128, 128, 3), 0.2, np.float32)
    mask = np.hypot(*(np.mgrid[:128, :128] - 63.5)) < 50
    print(network_maps(onnxruntime.InferenceSession("relight.onnx"), grey, mask)[2][64, 64])
