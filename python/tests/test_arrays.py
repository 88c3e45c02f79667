"""Shapes, batches, memory, threads and messages of the calls on arrays."""

from __future__ import annotations

import pickle
import re
import threading

import numpy as np
import pytest
import supple

ONE = ("mass_matrix", "gravity", "tip_pose", "jacobian")
TWO = ("coriolis", "coriolis_matrix", "jacobian_dot_qd")
THREE = ("rnea", "forward_dynamics", "regressor")
ARGUMENTS = {**dict.fromkeys(ONE, 1), **dict.fromkeys(TWO, 2), **dict.fromkeys(THREE, 3)}
METHODS = sorted(ARGUMENTS)
SHAPES = {
    "mass_matrix": (4, 4),
    "gravity": (4,),
    "tip_pose": (4, 4),
    "jacobian": (6, 4),
    "coriolis": (4,),
    "coriolis_matrix": (4, 4),
    "jacobian_dot_qd": (6,),
    "rnea": (4,),
    "forward_dynamics": (4,),
    "regressor": (4, 40),
}


@pytest.fixture(scope="module")
def arm():
    return supple.Arm.load("wam4")


def states(method, *batch):
    rng = np.random.default_rng(len(method))
    return [rng.normal(size=(*batch, 4)) for _ in range(ARGUMENTS[method])]


@pytest.mark.parametrize("method", METHODS)
def test_a_batch_equals_its_single_states(arm, method):
    call = getattr(arm, method)
    arguments = states(method, 3, 5)
    batched = call(*arguments)
    assert batched.shape == (3, 5, *SHAPES[method])
    assert batched.dtype == np.float64 and batched.flags.c_contiguous
    for index in np.ndindex(3, 5):
        single = call(*(a[index] for a in arguments))
        assert single.shape == SHAPES[method]
        np.testing.assert_array_equal(batched[index], single)


@pytest.mark.parametrize("method", METHODS)
def test_an_empty_batch_gives_an_empty_result(arm, method):
    assert getattr(arm, method)(*states(method, 0)).shape == (0, *SHAPES[method])


@pytest.mark.parametrize("method", METHODS)
def test_other_orders_and_dtypes_are_accepted(arm, method):
    call = getattr(arm, method)
    arguments = [np.round(a, 1) for a in states(method, 6)]
    reference = call(*arguments)
    np.testing.assert_array_equal(call(*(np.asfortranarray(a) for a in arguments)), reference)
    np.testing.assert_array_equal(call(*(a[::-1] for a in arguments))[::-1], reference)
    np.testing.assert_array_equal(call(*(a.tolist() for a in arguments)), reference)
    whole = [np.round(a).astype(np.int32) for a in arguments]
    np.testing.assert_array_equal(call(*whole), call(*(a.astype(float) for a in whole)))
    unaligned = [np.frombuffer(b"x" + a.tobytes(), offset=1).reshape(a.shape) for a in arguments]
    np.testing.assert_array_equal(call(*unaligned), reference)


def test_one_state_is_broadcast_to_a_batch(arm):
    q, qd, qdd = states("rnea", 7)
    expected = arm.rnea(q, np.tile(qd[0], (7, 1)), qdd)
    np.testing.assert_array_equal(arm.rnea(q, qd[0], qdd), expected)


@pytest.mark.parametrize("method", METHODS)
def test_out_is_filled_and_returned(arm, method):
    arguments = states(method, 4)
    out = np.full((4, *SHAPES[method]), np.nan)
    assert getattr(arm, method)(*arguments, out=out) is out
    np.testing.assert_array_equal(out, getattr(arm, method)(*arguments))


@pytest.mark.parametrize(
    ("out", "error", "message"),
    [
        (np.zeros((3, 4)), ValueError, "out: expected .* of shape (2, 4), got shape (3, 4)"),
        (np.zeros((2, 4), np.float32), TypeError, "out: expected a writable float64 array"),
        ([[0.0] * 4] * 2, TypeError, "got list"),
        (np.zeros((4, 2)).T, ValueError, "got another order"),
    ],
)
def test_an_unsuitable_out_is_rejected(arm, out, error, message):
    with pytest.raises(error, match=re.escape(message).replace(r"\.\*", ".*")):
        arm.gravity(np.zeros((2, 4)), out=out)


def test_out_must_be_writable_and_not_overlap(arm):
    out = np.zeros((2, 4))
    out.flags.writeable = False
    with pytest.raises(ValueError, match="out: .*not writeable"):
        arm.gravity(np.zeros((2, 4)), out=out)
    q = np.zeros((2, 4))
    with pytest.raises(ValueError, match="must not share memory with an argument"):
        arm.gravity(q, out=q)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.zeros(3), np.zeros(4), np.zeros(4)), "q: expected shape (4,) or (..., 4), got (3,)"),
        ((np.zeros(4), 1.0, np.zeros(4)), "qd: expected shape (4,) or (..., 4), got ()"),
        (
            (np.zeros((5, 4)), np.zeros((5, 4)), np.zeros((6, 4))),
            "qdd: expected shape (5, 4), the batch of q, or (4,), got (6, 4)",
        ),
        ((np.zeros((4, 5)), np.zeros(4), np.zeros(4)), "q: expected shape (4,) or (..., 4), got (4, 5)"),
        (([[0.0] * 4, [0.0] * 3], np.zeros(4), np.zeros(4)), "q: expected numbers, got list"),
    ],
)
def test_shape_mismatches_are_reported(arm, arguments, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        arm.rnea(*arguments)


def test_non_numeric_arguments_are_rejected(arm):
    with pytest.raises(TypeError, match="q: expected numbers, got dict"):
        arm.gravity({})
    with pytest.raises(ValueError, match="q: expected numbers, got str"):
        arm.gravity("wam4")
    # NumPy reads numbers from text.
    for text in (["0", "0", "0", "0"], np.array(["0"] * 4), np.array([b"0"] * 4)):
        with pytest.raises(ValueError, match="q: expected numbers, got"):
            arm.gravity(text)


def test_an_arm_is_immutable(arm):
    parameters = arm.parameters
    parameters[:] = 0.0
    assert arm.parameters.any()
    with pytest.raises(AttributeError):
        arm.dof = 3
    with pytest.raises(TypeError):
        type("Mine", (supple.Arm,), {})


def test_arms_can_be_pickled_to_other_processes(arm, tmp_path):
    copy = pickle.loads(pickle.dumps(arm))
    assert copy == arm and hash(copy) == hash(arm)
    np.testing.assert_array_equal(copy.parameters, arm.parameters)
    assert supple.Arm.load("wam3") != arm
    assert (arm == 4) is False
    friction = supple.Friction(viscous_nm_s_per_rad=1.0, coulomb_nm=0.5, breakaway_nm=0.7)
    assert pickle.loads(pickle.dumps(friction)) == friction


def test_the_gil_is_released_during_a_call(arm):
    """Another thread counts while a call runs, which needs the released lock."""
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 400_000, 4))
    running, counted = threading.Event(), []

    def count():
        running.wait()
        n = 0
        while running.is_set():
            n += 1
        counted.append(n)

    thread = threading.Thread(target=count)
    thread.start()
    running.set()
    before = threading.get_ident()
    arm.regressor(q[:1], qd[:1], qdd[:1])
    arm.rnea(q, qd, qdd)
    running.clear()
    thread.join()
    assert before == threading.get_ident()
    assert counted[0] > 100


def test_threads_get_the_same_numbers(arm):
    arguments = states("rnea", 5000)
    expected = arm.rnea(*arguments)
    results = [None] * 4

    def work(i):
        results[i] = arm.rnea(*arguments)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for result in results:
        np.testing.assert_array_equal(result, expected)
