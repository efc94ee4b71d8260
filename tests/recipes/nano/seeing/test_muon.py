import pytest
import torch

from recipes.nano.seeing.muon import Muon


def changes(optimizer_class, shape, **settings):
    """Of a matrix in five steps with random gradients."""
    torch.manual_seed(0)
    parameter = torch.nn.Parameter(torch.randn(shape))
    optimizer = optimizer_class([parameter], **settings)
    steps = []
    for _ in range(5):
        before = parameter.detach().clone()
        parameter.grad = torch.randn(shape)
        optimizer.step()
        steps.append(parameter.detach() - before)
    return torch.stack(steps)


@pytest.mark.parametrize("shape", [(24, 8), (8, 24), (16, 16)])
def test_steps_are_those_of_torch_but_for_its_rounding(shape):
    settings = {"lr": 0.01, "weight_decay": 0.1, "momentum": 0.9}
    ours = changes(Muon, shape, **settings)
    theirs = changes(torch.optim.Muon, shape, adjust_lr_fn="match_rms_adamw", **settings)
    assert (ours - theirs).norm() < 0.02 * theirs.norm()


def test_all_directions_of_a_step_are_about_as_long():
    (first, *_) = changes(Muon, (12, 30), lr=1.0)
    values = torch.linalg.svdvals(first)
    assert values.max() < 3 * values.min()


def test_a_parameter_without_a_gradient_stays():
    parameter = torch.nn.Parameter(torch.ones(2, 2))
    Muon([parameter], lr=1.0).step()
    assert parameter.tolist() == [[1, 1], [1, 1]]


def test_a_stored_state_continues_as_if_it_had_not_been_stored():
    def trained(n_before):
        torch.manual_seed(0)
        parameter = torch.nn.Parameter(torch.zeros(4, 6))
        optimizer = Muon([parameter], lr=0.1)
        for number in range(6):
            if number == n_before:
                state = optimizer.state_dict()
                optimizer = Muon([parameter], lr=0.1)
                optimizer.load_state_dict(state)
            parameter.grad = torch.randn(4, 6)
            optimizer.step()
        return parameter

    assert torch.equal(trained(3), trained(None))


def test_a_vector_is_refused():
    with pytest.raises(ValueError, match="1 dimensions; use matrices"):
        Muon([torch.nn.Parameter(torch.zeros(3))], lr=1.0)
