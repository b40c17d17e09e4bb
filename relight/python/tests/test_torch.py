"""The layers and the loss for PyTorch: values and gradients against the render layers of Rust."""

import math

import numpy
import pytest

import relit

torch = pytest.importorskip("torch", reason="torch is not installed")
import relit.torch as layers  # noqa: E402 - needs torch

#: A layer's own units in those of `relit.render`.
PLAIN = {"exposure": math.log2(math.pi)}
FORMS = [("irradiance", "lobe"), ("released", "power")]


def case(order, rows=6, columns=5):
    """Unit normals to the viewer's side, one pixel without a surface; albedo, reflectance, smoothness; light."""
    draw = numpy.random.default_rng(4)
    normals = draw.normal(size=(rows, columns, 3))
    normals[..., 2] = abs(normals[..., 2]) + 0.3
    normals /= numpy.linalg.norm(normals, axis=2, keepdims=True)
    normals[0, 0] = 0
    light = draw.normal(size=((order + 1) ** 2, 3)) / 8
    light[0] = [4.0, 3.0, 5.0]
    maps = [draw.uniform(0.2, 0.9, (rows, columns, channels)) for channels in (3, 3)]
    return normals, *maps, draw.uniform(2, 40, (rows, columns, 1)), light


def tensors(normals, albedo, reflectance, smoothness, light):
    planes = [torch.tensor(array).permute(2, 0, 1).contiguous() for array in (normals, albedo, reflectance, smoothness)]
    return [tensor.requires_grad_() for tensor in (*planes, torch.tensor(light))]


def rendered(normals, albedo, reflectance, smoothness, light, forms):
    specular = reflectance, smoothness[..., 0]
    named = {"diffuse_form": forms[0], "specular_form": forms[1]}
    return relit.render(normals, albedo, light, specular=specular, **named, **PLAIN).astype(numpy.float64)


def render(forms, normals, albedo, reflectance, smoothness, light):
    return layers.render(normals, albedo, light, (reflectance, smoothness), *forms)


@pytest.mark.parametrize("order", [2, 5])
@pytest.mark.parametrize("forms", FORMS)
def test_a_picture_is_the_one_of_rust(order, forms):
    arrays = case(order)
    image = render(forms, *tensors(*arrays)).permute(1, 2, 0).detach().numpy()
    wanted = rendered(*arrays, forms)
    assert numpy.allclose(image, wanted, atol=2e-3 * wanted.max())
    assert (image[0, 0] == 0).all()


@pytest.mark.parametrize("forms", FORMS)
def test_gradients_are_those_of_the_values(forms):
    arrays = case(2, 2, 3)
    # Where there is no surface nothing can be derived.
    arrays[0][0, 0] = [0, 0.6, 0.8]
    given = tensors(*arrays)
    assert torch.autograd.gradcheck(lambda *given: render(forms, *given), given, eps=1e-6, atol=1e-4)


@pytest.mark.parametrize("forms", FORMS)
def test_gradients_are_those_of_the_layers_of_rust(forms):
    """Central differences of what Rust renders, along a direction of each input."""
    arrays = case(2)
    given = tensors(*arrays)
    weights = numpy.random.default_rng(1).normal(size=arrays[0].shape)
    loss = (render(forms, *given) * torch.tensor(weights).permute(2, 0, 1)).sum()
    found = torch.autograd.grad(loss, given)
    steps = [0.01, 0.05, 0.05, 0.05, 0.05]
    for at, step in enumerate(steps):
        direction = numpy.random.default_rng(at).normal(size=arrays[at].shape)
        if at == 0:
            # Along the sphere, and of the same length.
            direction -= (direction * arrays[0]).sum(2, keepdims=True) * arrays[0]
            direction[0, 0] = 0
        elif at == 4:
            direction *= 0.1
        change = 0.0
        for sign in (1, -1):
            moved = list(arrays)
            moved[at] = arrays[at] + sign * step * direction
            if at == 0:
                moved[0] = moved[0] / numpy.maximum(numpy.linalg.norm(moved[0], axis=2, keepdims=True), 1e-9)
            change += sign * (rendered(*moved, forms) * weights).sum() / (2 * step)
        gradient = found[at].numpy() if at == 4 else found[at].permute(1, 2, 0).numpy()
        product = (gradient * direction).sum()
        scale = numpy.linalg.norm(gradient) * numpy.linalg.norm(direction) / math.sqrt(gradient.size)
        assert abs(product - change) < 0.03 * max(abs(change), scale), (at, product, change)


def test_batches_have_a_light_each_or_one_for_all():
    normals, albedo, *_, light = tensors(*case(2))
    two = torch.stack([light, 2 * light])
    images = layers.render(torch.stack([normals, normals]), albedo, two)
    assert torch.allclose(images[1], 2 * images[0]) and images.shape == (2, *normals.shape)
    assert torch.allclose(images[0], layers.render(normals, albedo, light))


def test_the_loss_is_what_rank_one_leaves():
    torch.manual_seed(2)
    one = torch.randn(12, 1).double() @ torch.randn(1, 300).double()
    assert layers.low_rank_loss(one) < 1e-18
    rows = (4 * one + torch.randn(12, 300).double()).requires_grad_()
    u, values, v = torch.linalg.svd(rows.detach(), full_matrices=False)
    loss = layers.low_rank_loss(rows)
    assert torch.isclose(loss, values[1:].square().sum())
    (gradient,) = torch.autograd.grad(loss, rows)
    assert torch.allclose(gradient, 2 * (rows.detach() - values[0] * u[:, :1] @ v[:1]), atol=1e-8)
    groups = torch.stack([rows.detach(), one])
    assert torch.isclose(layers.low_rank_loss(groups), loss.detach() / 2)
