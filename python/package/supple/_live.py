"""A running system from Python: its state, requests, and set-points."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple import _check, _native
from supple._check import flag, integer, number
from supple._frames import Tabular
from supple._plant import PlantOptions, _chosen

Array = NDArray[np.float64]

__all__ = ["Answer", "Refused", "SetPoints", "State", "States", "System", "connect", "simulated"]


class Refused(RuntimeError):
    """The controller refused a request; the message gives the reason. The controller's state has not changed."""


@dataclass(frozen=True)
class Answer:
    """The controller's answer to a request that it has accepted or, with ``at_cycle``, queued."""

    cycle: int
    """Cycle in which the controller received the request."""
    mode: str
    """Mode of the controller when it answered."""


@dataclass(frozen=True, eq=False)
class State:
    """One cycle of the controller. Vectors are in base axes."""

    cycle: int
    """Number of the cycle."""
    mode: str
    """Mode in force, such as ``"track"``."""
    mode_time_s: float
    """Time since the mode began (s)."""
    fault: str | None
    """Text of the latched fault."""
    q: Array
    """Joint angles, (N,) (rad)."""
    qd: Array
    """Joint velocities, (N,) (rad/s)."""
    tau: Array
    """Commanded torques, (N,) (N m)."""
    tip_position_m: Array
    """Tip, (3,) (m)."""
    tip_velocity_m_per_s: Array
    """Velocity of the tip, (3,) (m/s)."""
    reference_position_m: Array | None
    """Reference of the tip, (3,) (m); ``None`` if there is none."""
    external_force_n: Array
    """Observed force on the tip, (3,) (N)."""
    in_contact: bool
    """Whether contact is latched."""
    stiffness_n_per_m: Array
    """Stiffness in force, (3,) (N/m)."""
    damping_n_s_per_m: Array
    """Damping in force, (3,) (N s/m)."""
    columns: Mapping[str, Array]
    """Every number of the cycle by its name in the log."""

    def __repr__(self) -> str:
        fault = f", fault: {self.fault}" if self.fault else ""
        tip = ", ".join(f"{x:.4f}" for x in self.tip_position_m)
        return f"<State of cycle {self.cycle}: {self.mode}, tip ({tip}) m{fault}>"


@dataclass(frozen=True, eq=False)
class States(Tabular):
    """Consecutive cycles, one row for each."""

    cycle: NDArray[np.int64]
    """Numbers of the cycles, (cycles,). A gap means that some did not reach this connection."""
    t: Array
    """Time since the first row, (cycles,) (s)."""
    mode: NDArray[np.str_]
    """Modes, (cycles,)."""
    q: Array
    """Joint angles, (cycles, N) (rad)."""
    qd: Array
    """Joint velocities, (cycles, N) (rad/s)."""
    tau: Array
    """Commanded torques, (cycles, N) (N m)."""
    tip_position_m: Array
    """Tip, (cycles, 3) (m)."""
    has_reference: NDArray[np.bool_]
    """Whether the tip has a reference, (cycles,)."""
    reference_position_m: Array
    """Reference of the tip, (cycles, 3) (m); zero without one."""
    external_force_n: Array
    """Observed force on the tip, (cycles, 3) (N)."""
    columns: Mapping[str, Array]
    """Every number of a cycle by its name in the log, (cycles,) or (cycles, N or 3)."""

    def __len__(self) -> int:
        return len(self.cycle)

    def __repr__(self) -> str:
        return f"<States of {len(self)} cycles>"


def connect(prefix: str | None = None, *, watch: bool = False, timeout_s: float = 5.0) -> System:
    """Connect to a running system, such as one that ``supple up`` has started.

    At most five programs may be connected. One Python program at a time may command: the first command acquires that
    right until the connection is closed, and the error that another program gets names the process that has it. The
    command line and the live page may intervene at any time. The controller checks every request.

    Parameters
    ----------
    prefix : str, optional
        The system's ``--prefix``. Default: ``SUPPLE_PREFIX``, or else ``supple``.
    watch : bool
        Refuse every command from this connection, except :meth:`System.idle`.
    timeout_s : float
        Longest wait for the system's telemetry (s), zero or more.

    Returns
    -------
    System
        The connection, also as a context manager.

    Raises
    ------
    ConnectionError
        If no system runs under the prefix, or five programs are connected already.
    ValueError
        If the prefix cannot be one.

    Examples
    --------
    >>> import supple
    >>> supple.connect("nobody", timeout_s=0.1)
    Traceback (most recent call last):
    ...
    ConnectionError: no system is running under the prefix `nobody`: start one with `supple up`, ...
    """
    if prefix is not None:
        prefix = _check.text("prefix", prefix)
    watch = flag("watch", watch)
    return System(_native.Connection(prefix, number("timeout_s", timeout_s)), watch=watch)


def simulated(
    arm: _native.Arm,
    *,
    model: _native.Arm | None = None,
    start_rad: ArrayLike | None = None,
    stiffness_n_per_m: float = 5.0,
    gravity_error: float = 0.0,
    friction_error: float = 0.0,
    block: bool = False,
    seed: int = 0,
    plant_options: PlantOptions | None = None,
    realistic: bool = False,
) -> System:
    """A system in this process: the controller and the simulated arm, in gravity hold.

    It has the interface of a running one, and the same controller. Its time passes only while a call waits
    for it, so that a program is as fast as the simulation, and the same program gives the same numbers.

    Parameters
    ----------
    arm : Arm
        The arm, with its friction, limits and gains.
    model : Arm, optional
        The controller's model of it. Default: the arm itself with the errors below.
    start_rad : array_like, (N,), optional
        Pose at the start (rad). Default: the start of the paper's sinusoid, or the arm's home where that is out
        of reach.
    stiffness_n_per_m : float
        Stiffness of the tip on each axis (N/m).
    gravity_error, friction_error : float
        Relative errors of the controller's model, with signs drawn from ``seed``; not together with ``model``.
    block : bool
        Put the block of the paper's figure 5 beside the arm.
    seed : int
        Seed of all noise, zero or more.
    plant_options, realistic
        Effects of a real arm in the plant, as in :func:`simulate`.

    Returns
    -------
    System
        The system.

    Examples
    --------
    >>> import supple
    >>> system = supple.simulated(supple.Arm.load("wam4"), stiffness_n_per_m=200.0)
    >>> system.hold().mode
    'track'
    >>> start = system.state.tip_position_m
    >>> with system.set_points(rate_hz=100) as points:
    ...     for k in range(100):
    ...         points.send(start + [0.0, 0.0, 1e-4 * k])
    ...     state = points.finish()
    >>> bool(abs(state.tip_position_m[2] - start[2] - 0.01) < 2e-3)
    True
    """
    _check.arm("arm", arm)
    seed = integer("seed", seed)
    stiffness_n_per_m = number("stiffness_n_per_m", stiffness_n_per_m)
    gravity_error = number("gravity_error", gravity_error)
    friction_error = number("friction_error", friction_error)
    if model is not None:
        _check.arm("model", model)
        if gravity_error or friction_error:
            raise ValueError("gravity_error, friction_error: expected 0 if model is given")
    block = flag("block", block)
    start = None
    if start_rad is not None:
        start = _check.array("start_rad", start_rad, (arm.dof,)).tolist()
    options = {
        "start_rad": start,
        "stiffness_n_per_m": stiffness_n_per_m,
        "gravity_error": gravity_error,
        "friction_error": friction_error,
        "block": block,
        "seed": seed,
        "plant_options": _chosen(arm, plant_options, realistic),
    }
    return System(_native.Simulation(arm, model, options))


class System:
    """A running system; :func:`connect` and :func:`simulated` make it."""

    def __init__(self, native: _native.Connection | _native.Simulation, *, watch: bool = False) -> None:
        self._native = native
        self._watch = watch

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        rate = f"{1.0 / self.period_s:.0f} Hz"
        return f"<System {self.prefix!r} of {self.dof} joints at {rate}>"

    def close(self) -> None:
        """End the connection. The controller stays in its mode and the arm continues its motion."""
        self._native.close()

    @property
    def prefix(self) -> str:
        """Prefix of the system."""
        return self._native.prefix

    @property
    def dof(self) -> int:
        """Number of joints."""
        return self._native.dof

    @property
    def period_s(self) -> float:
        """Period of the controller (s)."""
        return self._native.period_s

    @property
    def lost(self) -> int:
        """Number of cycles that did not reach this connection."""
        return self._native.lost()

    @property
    def is_live(self) -> bool:
        """Whether time passes by itself; in a simulation of :func:`simulated` it passes while a call waits."""
        return isinstance(self._native, _native.Connection)

    # State of the controller

    @property
    def state(self) -> State:
        """The newest cycle that this connection has received."""
        row = self._native.latest()
        columns = {name: value[0] for name, value in row.items() if isinstance(value, np.ndarray)}
        return State(
            cycle=int(columns["cycle"]),
            mode=row["modes"][0],
            mode_time_s=float(columns["mode_time_s"]),
            fault=row["faults"][0],
            q=columns["position_rad"],
            qd=columns["velocity_rad_per_s"],
            tau=columns["torque_nm"],
            tip_position_m=columns["tip_position_m"],
            tip_velocity_m_per_s=columns["tip_velocity_m_per_s"],
            reference_position_m=columns["reference_position_m"] if columns["has_reference"] else None,
            external_force_n=columns["external_force_n"],
            in_contact=bool(columns["in_contact"]),
            stiffness_n_per_m=columns["stiffness_n_per_m"],
            damping_n_s_per_m=columns["damping_n_s_per_m"],
            columns=columns,
        )

    def record(self, duration_s: float) -> States:
        """Wait for a duration, and return every cycle that was received in it.

        Parameters
        ----------
        duration_s : float
            Time on the controller's clock (s), zero or more. Of more than 8192 cycles the beginning is lost: use
            :meth:`stream` for them.

        Returns
        -------
        States
            One row for each cycle.

        Raises
        ------
        ConnectionError
            If the system ends.
        """
        duration_s = number("duration_s", duration_s)
        begin = self._native.received()
        self.wait(duration_s)
        return _states(self._native.read(begin), self.period_s)

    def recent(self, duration_s: float = 1.0) -> States:
        """Return the last received cycles without waiting.

        Parameters
        ----------
        duration_s : float
            Time that they span (s).
        """
        cycles = max(1, round(number("duration_s", duration_s) / self.period_s))
        begin = max(0, self._native.received() - cycles)
        return _states(self._native.read(begin), self.period_s)

    def stream(self, every_s: float = 0.05) -> Iterator[States]:
        """Yield blocks of cycles as they are received, until telemetry ends or the caller leaves the loop.

        There is no gap as long as each block is used within the 8192 cycles that are kept.

        Parameters
        ----------
        every_s : float
            Time between two blocks (s). The stream ends if no cycle comes for a second more than that.
        """
        every_s = number("every_s", every_s)
        received = self._native.received()
        cycles = max(1, round(every_s / self.period_s))
        while True:
            self._native.wait(received + cycles - 1, every_s + 1.0)
            block = self._native.read(received)
            if not len(block["cycle"]):
                return
            received = block["first"] + len(block["cycle"])
            yield _states(block, self.period_s)

    def wait(self, duration_s: float) -> State:
        """Wait for a duration on the controller's clock, and return the state at its end.

        Parameters
        ----------
        duration_s : float
            Time (s), zero or more. When the host stalls, the time of a simulated arm pauses.
        """
        duration_s = number("duration_s", duration_s)
        received = self._native.received() + max(1, round(duration_s / self.period_s)) - 1
        while not self._native.wait(received, 5.0):
            before = self._native.received()
            if not self._native.wait(before, 5.0):
                raise ConnectionError(
                    f"no telemetry from the system {self.prefix!r}, {self._native.ended() or 'for 5 s'}: "
                    "`supple status` shows whether it runs"
                )
        return self.state

    # Requests

    def request(
        self,
        kind: str,
        values: ArrayLike = (),
        *,
        trajectory: str | None = None,
        at_cycle: int | None = None,
    ) -> Answer:
        """Send any request by the name and the values that logs have for it; the methods below are simpler.

        Parameters
        ----------
        kind : str
            Such as ``"gains"``.
        values : array_like
            Numbers of the request, in the order that the log's ``ControllerState`` lists.
        trajectory : str, optional
            Of a request ``"track"`` or ``"track_pose"``: ``"hold"``, ``"line"``, ``"sinusoid"``, ``"arc"``,
            ``"quadrant"``, ``"probe"``.
        at_cycle : int, optional
            Cycle in which it takes effect. Default: the next one.

        Raises
        ------
        Refused
            With the controller's reason.
        """
        self._check_command()
        kind = _check.text("kind", kind)
        if trajectory is not None:
            trajectory = _check.text("trajectory", trajectory)
        if at_cycle is not None:
            at_cycle = integer("at_cycle", at_cycle)
        numbers = _check.array("values", values).ravel().tolist()
        try:
            cycle, mode = self._native.request(kind, numbers, trajectory, at_cycle)
        except RuntimeError as refusal:
            raise Refused(str(refusal).removeprefix("refused: ")) from None
        if at_cycle is None:
            self._see(cycle)
        return Answer(cycle, mode)

    def idle(self) -> Answer:
        """Request idle: zero torque. The request bypasses the queue, and a watching connection may send it too."""
        cycle, mode = self._native.idle()
        self._see(cycle)
        return Answer(cycle, mode)

    def gravity_hold(self) -> Answer:
        """Compensate gravity and damp the joints."""
        return self.request("gravity_hold")

    def float_mode(self) -> Answer:
        """Compensate gravity without damping, so that a person can guide the arm by hand."""
        return self.request("float")

    def reset(self) -> Answer:
        """Clear the latched fault."""
        return self.request("reset")

    def move(self, target_rad: ArrayLike, duration_s: float, *, wait: bool = True) -> Answer:
        """Move the joints stiffly to a pose.

        Parameters
        ----------
        target_rad : array_like, (N,)
            Pose (rad); held joints at their own angle.
        duration_s : float
            Duration (s).
        wait : bool
            Return after its duration; the state's mode tells whether something has ended it.
        """
        target = self._joints("target_rad", target_rad)
        duration_s = number("duration_s", duration_s)
        answer = self.request("move", [*target, duration_s])
        if wait:
            self.wait(duration_s)
        return answer

    def joint_impedance(
        self, target_rad: ArrayLike | None = None, duration_s: float = 0.5, *, wait: bool = True
    ) -> Answer:
        """Hold a pose with compliant joints, by default the present one.

        Parameters
        ----------
        target_rad : array_like, (N,), optional
            Pose (rad).
        duration_s : float
            Duration of the way there (s).
        wait : bool
            Return after its duration; the state's mode tells whether something has ended it.
        """
        target = self.state.q if target_rad is None else self._joints("target_rad", target_rad)
        duration_s = number("duration_s", duration_s)
        answer = self.request("joint_impedance", [*target, duration_s])
        if wait:
            self.wait(duration_s)
        return answer

    def gains(
        self,
        stiffness_n_per_m: ArrayLike | None = None,
        damping_n_s_per_m: ArrayLike | None = None,
        *,
        axes: Literal["base", "tip"] = "base",
        ramp_s: float = 0.5,
    ) -> Answer:
        """Change stiffness and damping of the tip's position along a ramp.

        Parameters
        ----------
        stiffness_n_per_m, damping_n_s_per_m : array_like, () or (3,) or (3, 3), optional
            For all axes, for x, y, z, or as symmetric positive semi-definite matrices (N/m, N s/m). Matrices need
            six active joints, come in pairs and act while the pose is tracked. Default: as they are.
        axes : {"base", "tip"}
            Axes of matrices; ``"tip"`` turns with the reference of the tip's orientation.
        ramp_s : float
            Time of the ramp (s).
        """
        ramp_s = number("ramp_s", ramp_s)
        given = (stiffness_n_per_m, damping_n_s_per_m)
        if axes != "base" or any(value is not None and np.ndim(value) == 2 for value in given):
            matrices = [
                *_symmetric("stiffness_n_per_m", stiffness_n_per_m),
                *_symmetric("damping_n_s_per_m", damping_n_s_per_m),
            ]
            return self.request("gain_matrices", [0.0, *matrices, _axes_code(axes), ramp_s])
        now = self.state
        stiffness = _axes("stiffness_n_per_m", stiffness_n_per_m, now.stiffness_n_per_m)
        damping = _axes("damping_n_s_per_m", damping_n_s_per_m, now.damping_n_s_per_m)
        return self.request("gains", [*stiffness, *damping, ramp_s])

    def rotational_gains(
        self,
        stiffness_nm_per_rad: ArrayLike,
        damping_nm_s_per_rad: ArrayLike,
        *,
        axes: Literal["base", "tip"] = "base",
        ramp_s: float = 0.5,
    ) -> Answer:
        """Change stiffness and damping of the tip's orientation along a ramp.

        Parameters
        ----------
        stiffness_nm_per_rad, damping_nm_s_per_rad : array_like, () or (3,) or (3, 3)
            About all axes, about x, y, z, or as symmetric positive semi-definite matrices (N m/rad, N m s/rad).
        axes : {"base", "tip"}
            Axes about which they act; ``"tip"`` turns with the reference of the tip's orientation.
        ramp_s : float
            Time of the ramp (s).
        """
        ramp_s = number("ramp_s", ramp_s)
        stiffness = _symmetric("stiffness_nm_per_rad", stiffness_nm_per_rad)
        damping = _symmetric("damping_nm_s_per_rad", damping_nm_s_per_rad)
        return self.request("gain_matrices", [1.0, *stiffness, *damping, _axes_code(axes), ramp_s])

    def turn(self, axis: ArrayLike, angle_rad: float, duration_s: float, *, wait: bool = True) -> Answer:
        """Turn the tip about an axis at constant position, and hold the final pose. Needs six active joints.

        Parameters
        ----------
        axis : array_like, (3,)
            Axis of the rotation, base axes; its length does not matter.
        angle_rad : float
            Angle (rad).
        duration_s : float
            Duration of the rotation (s).
        wait : bool
            Return after its duration; the state's mode tells whether something has ended it.
        """
        direction = _axes("axis", axis, None)
        length = float(np.linalg.norm(direction))
        if not length > 0.0:
            raise ValueError(f"axis: expected a direction, got {direction.tolist()}")
        angle_rad = number("angle_rad", angle_rad, signed=True)
        duration_s = number("duration_s", duration_s)
        values = [*(direction / length), angle_rad, duration_s, *self._reference_m()]
        answer = self.request("track_pose", values, trajectory="hold")
        if wait:
            self.wait(duration_s)
        return answer

    def joint_gains(
        self, stiffness_nm_per_rad: ArrayLike, damping_nm_s_per_rad: ArrayLike, *, ramp_s: float = 0.5
    ) -> Answer:
        """Change the gains of compliant joints along a ramp.

        Parameters
        ----------
        stiffness_nm_per_rad, damping_nm_s_per_rad : array_like, () or (N,)
            For all joints, or for each (N m/rad, N m s/rad).
        ramp_s : float
            Time of the ramp (s).
        """
        ramp_s = number("ramp_s", ramp_s)
        values = []
        for name, given in (
            ("stiffness_nm_per_rad", stiffness_nm_per_rad),
            ("damping_nm_s_per_rad", damping_nm_s_per_rad),
        ):
            array = _check.array(name, given)
            values += list(np.full(self.dof, array) if array.ndim == 0 else self._joints(name, array))
        return self.request("joint_gains", [*values, ramp_s])

    def hold(self) -> Answer:
        """Hold the tip at its present reference, with the present stiffness."""
        return self.request("track", self._reference_m(), trajectory="hold")

    def line(self, to_m: ArrayLike, duration_s: float, *, wait: bool = True) -> Answer:
        """Move the tip on a straight line from its reference, or from its position if there is no reference.

        Parameters
        ----------
        to_m : array_like, (3,)
            End, base axes (m).
        duration_s : float
            Duration (s).
        wait : bool
            Return after its duration; the state's mode tells whether something has ended it.
        """
        duration_s = number("duration_s", duration_s)
        values = [*self._reference_m(), *_axes("to_m", to_m, None), duration_s]
        answer = self.request("track", values, trajectory="line")
        if wait:
            self.wait(duration_s)
        return answer

    def sinusoid(
        self, amplitude_m: ArrayLike, frequency_hz: float, *, centre_m: ArrayLike | None = None, ramp_s: float = 1.0
    ) -> Answer:
        """Let the tip oscillate along a line.

        Parameters
        ----------
        amplitude_m : array_like, (3,)
            Direction and amplitude, base axes (m).
        frequency_hz : float
            Frequency (Hz).
        centre_m : array_like, (3,), optional
            Centre, where it begins, base axes (m). Default: the tip's reference, or the tip without one.
        ramp_s : float
            Time in which it reaches its speed (s).
        """
        frequency_hz = number("frequency_hz", frequency_hz, signed=True)
        ramp_s = number("ramp_s", ramp_s)
        centre = _axes("centre_m", centre_m, self._reference_m())
        amplitude = _axes("amplitude_m", amplitude_m, None)
        values = [*centre, *amplitude, 2.0 * np.pi * frequency_hz, ramp_s]
        return self.request("track", values, trajectory="sinusoid")

    def set_points(self, rate_hz: float = 100.0, *, lead_s: float = 0.05) -> SetPoints:
        """Stream set-points of the tip; use it in a ``with`` statement.

        The tip is held first. Each set-point carries the cycle at which the reference is to pass it, ``lead_s``
        after it is sent, so that late or early calls do not move the arm otherwise. Between set-points the
        controller interpolates by quintic polynomials. If none comes in time, the reference comes to rest and
        stays. The arm also stays where it is when the ``with`` statement ends.

        Parameters
        ----------
        rate_hz : float
            Set-points per second, up to the rate of the controller (Hz).
        lead_s : float
            Time by which each is ahead (s): at least one period, at most 1 s. It is the delay of the stream and
            the longest interruption that it survives.
        """
        return SetPoints(self, rate_hz, lead_s)

    def _see(self, cycle: int) -> None:
        """Waits briefly for the telemetry of a cycle: it may arrive after the reply, and ``state`` must include the request."""
        native = self._native
        while native.cycle() < cycle and native.wait(native.received(), 0.2):
            pass

    def _reference_m(self) -> Array:
        """Returns the tip's reference position, or the tip position if there is no reference (m)."""
        now = self.state
        return now.tip_position_m if now.reference_position_m is None else now.reference_position_m

    def _joints(self, name: str, given: ArrayLike) -> Array:
        array = _check.array(name, given)
        if array.shape != (self.dof,):
            raise ValueError(f"{name}: expected shape ({self.dof},), one angle for each joint, got {array.shape}")
        return array

    def _check_command(self) -> None:
        if self._watch:
            raise PermissionError("this connection only watches: connect without watch=True to command")


class SetPoints:
    """A stream of set-points; :meth:`System.set_points` makes it."""

    def __init__(self, system: System, rate_hz: float, lead_s: float) -> None:
        system._check_command()
        rate_hz = number("rate_hz", rate_hz, signed=True)
        lead_s = number("lead_s", lead_s, signed=True)
        fastest = 1.0 / system.period_s
        if not 0.0 < rate_hz <= 1.001 * fastest:
            raise ValueError(
                f"rate_hz: expected more than 0, at most the {fastest:.0f} Hz of the controller, got {rate_hz}"
            )
        if not system.period_s <= lead_s <= 1.0:
            raise ValueError(f"lead_s: expected {system.period_s} s to 1 s, got {lead_s}")
        self._system = system
        self._interval_s = 1.0 / rate_hz
        self._lead_s = lead_s
        self._begin = 0
        self._sent = 0
        self._last: list[Array] = []

    def __enter__(self) -> Self:
        self._system.hold()
        self._begin = self._system._native.cycle() + round(self._lead_s / self._system.period_s)
        self._sent = 0
        self._system._native.take_refusal()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        pass

    @property
    def time_s(self) -> float:
        """Time of the next set-point since the first (s)."""
        return self._sent * self._interval_s

    def send(
        self,
        position_m: ArrayLike,
        velocity_m_per_s: ArrayLike | None = None,
        acceleration_m_per_s2: ArrayLike | None = None,
        *,
        pace: bool = True,
    ) -> None:
        """Send the next set-point, ``1 / rate_hz`` after the one before.

        Parameters
        ----------
        position_m : array_like, (3,)
            Position, base axes (m).
        velocity_m_per_s : array_like, (3,), optional
            Velocity there (m/s). Default: from the last three positions; zero at the first, and after a late one.
        acceleration_m_per_s2 : array_like, (3,), optional
            Acceleration there (m/s^2). Default: zero.
        pace : bool
            Wait until it is due. Without it the caller keeps the time. A set-point that comes too late is passed
            ``lead_s`` from now, and the later ones follow it.

        Raises
        ------
        Refused
            If the controller has refused an earlier set-point, such as one that is out of reach or too fast, or
            if somebody else has ended the motion. The reference then comes to rest.
        """
        native, period_s = self._system._native, self._system.period_s
        position = _axes("position_m", position_m, None)
        given = None if velocity_m_per_s is None else _axes("velocity_m_per_s", velocity_m_per_s, None)
        acceleration = _axes("acceleration_m_per_s2", acceleration_m_per_s2, np.zeros(3))
        at_cycle = self._begin + round(self.time_s / period_s)
        self._raise_refusal()
        lead = round(self._lead_s / period_s)
        if pace:
            self._wait_until(at_cycle - lead)
        late = native.cycle() + 1 - at_cycle
        if late >= 0:
            # The caller sent nothing for longer than the lead: the reference rests, or soon will.
            self._begin += late + lead
            at_cycle += late + lead
            self._last.clear()
        velocity = self._estimate(position) if given is None else given
        self._last = [*self._last[-1:], position]
        native.set_point(position.tolist(), velocity.tolist(), acceleration.tolist(), at_cycle)
        self._sent += 1

    def wait(self) -> State:
        """Wait until the next set-point is due, and return the state at that time."""
        period_s = self._system.period_s
        self._wait_until(self._begin + round(self.time_s / period_s) - round(self._lead_s / period_s))
        return self._system.state

    def finish(self) -> State:
        """Wait until the reference rests, and return the state at that time."""
        state = self._system.wait(self._lead_s)
        self._raise_refusal()
        while state.mode == "track" and state.columns["reference_velocity_m_per_s"].any():
            state = self._system.wait(0.02)
        self._raise_refusal()
        return state

    def _estimate(self, position: Array) -> Array:
        """Returns the velocity at the newest of up to three equally spaced points; zero after the first point."""
        if not self._last:
            return np.zeros(3)
        h = self._interval_s
        if len(self._last) == 1:
            return np.asarray((position - self._last[-1]) / h)
        return np.asarray((3.0 * position - 4.0 * self._last[-1] + self._last[-2]) / (2.0 * h))

    def _wait_until(self, cycle: int) -> None:
        native, slept_at = self._system._native, -1
        while True:
            now = native.cycle()
            missing = cycle - now
            if missing <= 0:
                return
            # Sleep for most of the wait while cycles arrive; then wait for each cycle.
            if self._system.is_live and missing * self._system.period_s > 0.02 and now != slept_at:
                slept_at = now
                time.sleep(0.5 * missing * self._system.period_s)
            elif not native.wait(native.received(), 5.0):
                reason = native.ended() or "for 5 s"
                raise ConnectionError(f"no telemetry from the system {self._system.prefix!r}, {reason}")

    def _raise_refusal(self) -> None:
        refusal = self._system._native.take_refusal()
        if refusal is not None:
            raise Refused(refusal.removeprefix("refused: "))


def _axes(name: str, given: ArrayLike | None, otherwise: Array | None) -> Array:
    if given is None and otherwise is not None:
        return otherwise
    array = _check.array(name, np.nan if given is None else given)
    if array.ndim == 0 and otherwise is not None:
        array = np.full(3, array)
    if array.shape != (3,):
        wanted = "a number or shape (3,)" if otherwise is not None else "shape (3,)"
        raise ValueError(f"{name}: expected {wanted}, for x, y, z of the base axes, got {array.shape}")
    return array


def _symmetric(name: str, given: ArrayLike | None) -> list[float]:
    """Returns xx, yy, zz, yz, zx, xy of a symmetric matrix; one number or three numbers give a diagonal matrix."""
    array = _check.array(name, np.nan if given is None else given)
    if array.ndim == 0:
        array = np.full(3, array)
    if array.shape == (3,):
        array = np.diag(array)
    if given is None or array.shape != (3, 3):
        found = "nothing" if given is None else str(array.shape)
        raise ValueError(f"{name}: expected a number, shape (3,) or shape (3, 3), got {found}")
    if not np.array_equal(array, array.T):
        raise ValueError(f"{name}: expected a symmetric matrix, got {array.tolist()}")
    return [float(array[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))]


def _axes_code(axes: str) -> float:
    names = ("base", "tip")
    if axes not in names:
        raise ValueError(f"axes: expected 'base' or 'tip', got {axes!r}")
    return float(names.index(axes))


def _states(block: dict[str, Any], period_s: float) -> States:
    columns = {name: value for name, value in block.items() if isinstance(value, np.ndarray)}
    cycle = columns["cycle"].astype(np.int64)
    return States(
        cycle=cycle,
        t=(cycle - cycle[0]) * period_s if len(cycle) else np.zeros(0),
        mode=np.array(block["modes"], dtype=np.str_),
        q=columns["position_rad"],
        qd=columns["velocity_rad_per_s"],
        tau=columns["torque_nm"],
        tip_position_m=columns["tip_position_m"],
        has_reference=columns["has_reference"].astype(bool),
        reference_position_m=columns["reference_position_m"],
        external_force_n=columns["external_force_n"],
        columns=columns,
    )
