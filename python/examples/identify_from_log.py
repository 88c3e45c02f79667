"""From a log to a controller with the identified model: identify, validate, save, run.

    python identify_from_log.py --out identified
    python identify_from_log.py --log training.mcap --held-out other.mcap --arm wam4 --out identified

Without your own logs, two are first recorded on the simulated arm. The last step runs the paper's
sinusoid at 5 N/m with the saved model, in simulation: no evidence for a real arm.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import supple

# Commands act during the next cycle: on average 1.5 periods after the angle in the same row.
TORQUE_DELAY_S = 1.5e-3


def record(arm: supple.Arm, folder: Path, seed: int, candidates: int) -> Path:
    """Records a designed excitation on the simulated arm."""
    motion = supple.design_excitation(arm, candidates=candidates, period_s=10.0, periods=2, seed=seed)
    print(f"excitation of {motion.t[-1]:.0f} s, condition number {motion.condition:.1f}")
    folder.mkdir(parents=True, exist_ok=True)
    recording = supple.excite(arm, motion, seed=seed, log_dir=folder)
    assert recording.log is not None
    return recording.log


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--arm", default="wam4", help="a built-in arm, or the path of its TOML")
    parser.add_argument("--log", type=Path, help="the log to fit")
    parser.add_argument("--held-out", type=Path, help="a log to validate the fit")
    parser.add_argument("--out", type=Path, default=Path("identified"))
    parser.add_argument("--candidates", type=int, default=1000, help="number of candidates of the excitation design")
    options = parser.parse_args()

    arm = supple.Arm.load(options.arm)
    training = options.log or record(arm, options.out / "training", 0, options.candidates)
    held_out = options.held_out or record(arm, options.out / "held_out", 1, options.candidates)

    log = supple.read_log(training)
    exciting = log.mode == "excite"
    fit = supple.identify(
        arm,
        log.t[exciting],
        log.q[exciting],
        log.tau[exciting],
        cutoff_hz=8.0,
        keep_every=10,
        torque_delay_s=TORQUE_DELAY_S,
        friction="stribeck",
    )
    print(fit)

    log = supple.read_log(held_out)
    exciting = log.mode == "excite"
    validation = fit.validate(log.t[exciting], log.q[exciting], log.tau[exciting])
    print(f"held out: {100.0 * validation.total_relative:.2f} % of the torque; {validation.verdict}")

    path = fit.save(options.out)
    run = supple.simulate(arm, "sinusoid", model=supple.Arm.load(path), load=False)
    print(f"{path}: sinusoid at 5 N/m, {1e3 * run.rms_error_m:.1f} mm RMS in simulation")


if __name__ == "__main__":
    main()
