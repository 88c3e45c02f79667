"""The environment: the interface of Gymnasium, and an arm that goes where the action leads."""

from __future__ import annotations

import numpy as np
import pytest
import supple

gymnasium = pytest.importorskip("gymnasium")


# What it observes has no bounds that hold in every pose and fault.
@pytest.mark.filterwarnings("ignore:.*Box observation space m.*imum value is -?infinity")
def test_it_has_the_interface_and_is_reproducible():
    import supple.gym
    from gymnasium.utils.env_checker import check_env

    env = supple.gym.ReachEnv(supple.Arm.load("wam3"), duration_s=0.3)
    check_env(env, skip_render_check=True)


def test_a_simple_policy_reaches_the_goal():
    import supple.gym

    env = supple.gym.ReachEnv(supple.Arm.load("wam4"), duration_s=3.0)
    observation, info = env.reset(seed=3)
    far_m = np.linalg.norm(observation[-6:-3])
    done = False
    while not done:
        way_m = info["goal_m"] - env._reference
        action = way_m * 20.0 / 0.1
        observation, reward, terminated, truncated, info = env.step(action)
        assert not terminated and "refused" not in info
        done = truncated
    assert info["distance_m"] < 0.2 * far_m and info["distance_m"] < 6e-3
    assert reward == pytest.approx(-info["distance_m"] - 0.01 * info["force_n"])


def test_wrong_arguments_are_named():
    import supple.gym

    with pytest.raises(ValueError, match="arm, system"):
        supple.gym.ReachEnv()
    env = supple.gym.ReachEnv(supple.Arm.load("wam3"))
    with pytest.raises(RuntimeError, match="reset"):
        env.step(np.zeros(3))
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"action: expected shape \(3,\)"):
        env.step(np.zeros(2))


def test_a_simulated_system_can_be_given_and_is_used_again():
    import supple.gym

    system = supple.simulated(supple.Arm.load("wam4"), seed=1)
    env = supple.gym.ReachEnv(system=system, duration_s=0.5)
    for seed in (1, 2):
        observation, info = env.reset(seed=seed)
        assert env.system is system and env.observation_space.contains(observation)
        # A reset leaves the arm where it is: the goal is near its reference, wherever that is now.
        reference = system.state.reference_position_m
        assert np.abs(info["goal_m"] - reference).max() <= 0.05
        truncated = False
        while not truncated:
            _, _, terminated, truncated, info = env.step(np.array([0.3, 0.0, 0.1]))
            assert not terminated and "refused" not in info, info
