"""A Gymnasium environment over a simulated or a running system (``pip install './python[gym]'``).

The action is where the tip's reference shall go; the controller of the system moves it there, with all its checks. So a
policy cannot command more than a person can, and one that stops leaves the arm holding.

Examples
--------
>>> import supple, supple.gym
>>> env = supple.gym.ReachEnv(supple.Arm.load("wam4"))
>>> observation, info = env.reset(seed=1)
>>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
>>> observation.shape == env.observation_space.shape, terminated
(True, False)
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from supple import _native
from supple._live import Refused, SetPoints, State, System, simulated

__all__ = ["ReachEnv"]

Array = NDArray[np.float64]


class ReachEnv(gymnasium.Env[Array, Array]):
    """Bring the tip to a goal near its start, softly.

    *Action*, (3,): velocity that the tip's reference shall have at the end of the step, as a share of ``speed_m_per_s`` along
    the base axes, -1 to 1. It changes by at most ``acceleration_m_per_s2`` times the length of the step.

    *Observation*, (3 N + 9,): joint angles (rad), velocities (rad/s) and commanded torques (N m), then the tip, its
    way to the goal (m) and the observed force on it (N), in base axes.

    *Reward*: minus the distance to the goal (m), minus ``force_cost_per_n`` times the observed force. The episode ends at a
    fault of the controller (``info["fault"]``), and is truncated after ``duration_s``. An action that the controller refuses
    lets the reference come to rest (``info["refused"]``).

    Parameters
    ----------
    arm : Arm, optional
        The arm of a simulated system, which every reset makes anew.
    system : System, optional
        A system to use instead, such as ``supple.connect()``: a reset leaves its arm where it is.
    rate_hz : float
        Steps per second of the arm's time (Hz).
    speed_m_per_s : float
        Greatest speed of the reference along an axis (m/s).
    acceleration_m_per_s2 : float
        Greatest mean acceleration of the reference over a step along an axis (m/s^2). Its peak is half as much again.
    reach_m : float
        Greatest distance of a goal from the start, along an axis (m).
    duration_s : float
        Length of an episode (s).
    force_cost_per_n : float
        Cost of a newton, in metres of distance.
    options : mapping, optional
        Further arguments of :func:`supple.simulated`.
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        arm: _native.Arm | None = None,
        *,
        system: System | None = None,
        rate_hz: float = 20.0,
        speed_m_per_s: float = 0.1,
        acceleration_m_per_s2: float = 2.0,
        reach_m: float = 0.05,
        duration_s: float = 5.0,
        force_cost_per_n: float = 0.01,
        options: dict[str, Any] | None = None,
    ) -> None:
        self._arm = arm
        self._options = options or {}
        if arm is not None and system is None:
            self._system = simulated(arm, **self._options)
        elif system is not None and arm is None:
            self._system = system
        else:
            raise ValueError("arm, system: expected exactly one of them")
        self._rate_hz = rate_hz
        self._speed_m_per_s = speed_m_per_s
        self._change_m_per_s = acceleration_m_per_s2 / rate_hz
        self._reach_m = reach_m
        self._steps = round(duration_s * rate_hz)
        self._force_cost = force_cost_per_n
        self._points: SetPoints | None = None
        self._taken = 0
        self._reference = self._velocity = self._goal = np.zeros(3)
        size = 3 * self._system.dof + 9
        self.action_space = spaces.Box(-1.0, 1.0, (3,), np.float64)
        self.observation_space = spaces.Box(-np.inf, np.inf, (size,), np.float64)

    @property
    def system(self) -> System:
        """The system in use."""
        return self._system

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode; ``options={"goal_m": (x, y, z)}`` gives the goal, base axes (m)."""
        super().reset(seed=seed)
        if self._arm is not None:
            plant_seed = int(self.np_random.integers(2**31))
            self._system = simulated(self._arm, **({"seed": plant_seed} | self._options))
        self._points = self._system.set_points(self._rate_hz, lead_s=max(0.05, 1.0 / self._rate_hz)).__enter__()
        state = self._system.state
        reference = state.reference_position_m
        self._reference = state.tip_position_m if reference is None else reference
        self._velocity = np.zeros(3)
        goal = (options or {}).get("goal_m")
        offset = self.np_random.uniform(-self._reach_m, self._reach_m, 3)
        self._goal = self._reference + offset if goal is None else np.asarray(goal, np.float64)
        self._taken = 0
        return self._observation(state), {"goal_m": self._goal.copy()}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Move the reference for one step; returns observation, reward, terminated, truncated and info."""
        if self._points is None:
            raise RuntimeError("the environment was not reset: call reset() first")
        wanted = np.asarray(action, np.float64)
        if wanted.shape != (3,):
            raise ValueError(f"action: expected shape (3,), for x, y, z of the base axes, got {wanted.shape}")
        info: dict[str, Any] = {"goal_m": self._goal.copy()}
        velocity = self._speed_m_per_s * np.clip(wanted, -1.0, 1.0)
        change = np.clip(velocity - self._velocity, -self._change_m_per_s, self._change_m_per_s)
        velocity = self._velocity + change
        # Displacement at constant acceleration, so that the reference goes straight from one velocity to the next.
        target = self._reference + 0.5 * (self._velocity + velocity) / self._rate_hz
        try:
            self._points.send(target, velocity)
        except Refused as refusal:
            info["refused"] = str(refusal)
            state = self._system.wait(1.0 / self._rate_hz)
            reference = state.reference_position_m
            self._reference = state.tip_position_m if reference is None else reference
            self._velocity = state.columns["reference_velocity_m_per_s"]
        else:
            state = self._points.wait()
            self._reference, self._velocity = target, velocity
        self._taken += 1
        force_n = float(np.linalg.norm(state.external_force_n))
        distance_m = float(np.linalg.norm(self._goal - state.tip_position_m))
        info |= {"distance_m": distance_m, "force_n": force_n, "fault": state.fault}
        reward = -distance_m - self._force_cost * force_n
        return self._observation(state), reward, state.fault is not None, self._taken >= self._steps, info

    def close(self) -> None:
        """Close the connection to a running system; its controller then holds the arm."""
        self._system.close()

    def _observation(self, state: State) -> Array:
        parts = (
            state.q,
            state.qd,
            state.tau,
            state.tip_position_m,
            self._goal - state.tip_position_m,
            state.external_force_n,
        )
        return np.concatenate(parts)
