//! The checks of the machine; each reads only files.

use super::machine::Machine;
use serde::Serialize;
use std::fmt;

/// Priority of the control thread under SCHED_FIFO.
const PRIORITY: u64 = 80;
/// Memory that the controller and the bus process lock, with a margin \[byte\].
const MEMORY_TO_LOCK: u64 = 256 << 20;
/// `CAP_IPC_LOCK` of `linux/capability.h`.
const CAP_IPC_LOCK: u32 = 14;
/// `CAP_SYS_NICE` of `linux/capability.h`.
const CAP_SYS_NICE: u32 = 23;
/// `ARPHRD_CAN` of `linux/if_arp.h`.
const ARPHRD_CAN: i64 = 280;

/// Verdict of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The requirement is met.
    Pass,
    /// The result is not ideal or unknown: cycles may be late, or a CAN bus cannot be used.
    Warn,
    /// The real-time requirements are not met.
    Fail,
}

/// Result of a check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Check {
    /// Short name, which does not change between versions.
    pub name: &'static str,
    /// Verdict.
    pub verdict: Verdict,
    /// The finding.
    pub found: String,
    /// Remedy if the check did not pass.
    pub remedy: Option<&'static str>,
}

impl Check {
    pub(super) fn pass(name: &'static str, found: impl Into<String>) -> Check {
        Check {
            name,
            verdict: Verdict::Pass,
            found: found.into(),
            remedy: None,
        }
    }

    pub(super) fn warn(
        name: &'static str,
        found: impl Into<String>,
        remedy: &'static str,
    ) -> Check {
        Check {
            name,
            verdict: Verdict::Warn,
            found: found.into(),
            remedy: Some(remedy),
        }
    }

    fn fail(name: &'static str, found: impl Into<String>, remedy: &'static str) -> Check {
        Check {
            verdict: Verdict::Fail,
            ..Check::warn(name, found, remedy)
        }
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.verdict {
            Verdict::Pass => "ok  ",
            Verdict::Warn => "warn",
            Verdict::Fail => "FAIL",
        };
        write!(f, "{verdict}  {:14} {}", self.name, self.found)?;
        match self.remedy {
            Some(remedy) => write!(f, "\n{:21}-> {remedy}", ""),
            None => Ok(()),
        }
    }
}

/// Runs all checks.
pub fn all(machine: &Machine) -> Vec<Check> {
    vec![
        kernel(machine),
        priority(machine),
        throttling(machine),
        memory_lock(machine),
        governor(machine),
        isolation(machine),
        clock(machine),
        shared_memory(machine),
        can(machine),
    ]
}

fn kernel(machine: &Machine) -> Check {
    const NAME: &str = "kernel";
    let Some(release) = machine.read("proc/sys/kernel/osrelease") else {
        return Check::fail(NAME, "not Linux", "the realtime system runs on Linux only");
    };
    if machine.number("sys/kernel/realtime") == Some(1) {
        return Check::pass(NAME, format!("{release}, PREEMPT_RT"));
    }
    Check::warn(
        NAME,
        format!("{release}, not PREEMPT_RT"),
        "install a realtime kernel (Debian: linux-image-rt-amd64), which bounds the latencies",
    )
}

fn priority(machine: &Machine) -> Check {
    const NAME: &str = "priority";
    if machine.has_capability(CAP_SYS_NICE) {
        return Check::pass(NAME, "CAP_SYS_NICE: SCHED_FIFO may be set");
    }
    match machine.limit("Max realtime priority") {
        Some(None) => Check::pass(NAME, "rtprio unlimited"),
        Some(Some(limit)) if limit >= PRIORITY => Check::pass(NAME, format!("rtprio {limit}")),
        limit => Check::fail(
            NAME,
            format!("rtprio {}, needs {PRIORITY}", limit.flatten().unwrap_or(0)),
            "add `@realtime - rtprio 90` to /etc/security/limits.conf, join that group, log in again",
        ),
    }
}

fn throttling(machine: &Machine) -> Check {
    const NAME: &str = "throttling";
    match machine.number("proc/sys/kernel/sched_rt_runtime_us") {
        Some(-1) => Check::pass(NAME, "off"),
        Some(0) => Check::fail(
            NAME,
            "realtime threads get no processor time (sched_rt_runtime_us = 0)",
            "sysctl kernel.sched_rt_runtime_us=950000",
        ),
        Some(runtime_us) => Check::pass(
            NAME,
            format!(
                "after {runtime_us} us of each scheduler period; the control thread sleeps for much longer than the remaining time"
            ),
        ),
        None => Check::warn(
            NAME,
            "sched_rt_runtime_us cannot be read",
            "mount /proc so that this user can read it",
        ),
    }
}

fn memory_lock(machine: &Machine) -> Check {
    const NAME: &str = "memlock";
    if machine.has_capability(CAP_IPC_LOCK) {
        return Check::pass(NAME, "CAP_IPC_LOCK: all memory may be locked");
    }
    match machine.limit("Max locked memory") {
        Some(None) => Check::pass(NAME, "unlimited"),
        Some(Some(bytes)) if bytes >= MEMORY_TO_LOCK => {
            Check::pass(NAME, format!("{} MiB", bytes >> 20))
        }
        limit => Check::fail(
            NAME,
            format!(
                "{} KiB, needs {} MiB",
                limit.flatten().unwrap_or(0) >> 10,
                MEMORY_TO_LOCK >> 20
            ),
            "add `@realtime - memlock unlimited` to /etc/security/limits.conf, log in again",
        ),
    }
}

fn governor(machine: &Machine) -> Check {
    const NAME: &str = "governor";
    const CPUS: &str = "sys/devices/system/cpu";
    let governors: Vec<_> = machine
        .list(CPUS)
        .iter()
        .filter_map(|cpu| machine.read(&format!("{CPUS}/{cpu}/cpufreq/scaling_governor")))
        .collect();
    let slow: Vec<_> = governors.iter().filter(|g| *g != "performance").collect();
    match (governors.len(), slow.first()) {
        (0, _) => Check::warn(
            NAME,
            "no frequency governor: the frequency is fixed, or the host of a virtual machine scales it",
            "on a virtual machine, set the governor of the host to performance",
        ),
        (_, None) => Check::pass(NAME, "performance"),
        (all, Some(governor)) => Check::warn(
            NAME,
            format!(
                "{} of {all} cores not at performance, such as {governor}",
                slow.len()
            ),
            "cpupower frequency-set --governor performance",
        ),
    }
}

fn isolation(machine: &Machine) -> Check {
    const NAME: &str = "isolation";
    match machine.read("sys/devices/system/cpu/isolated") {
        Some(cpus) if !cpus.is_empty() => Check::pass(NAME, format!("cores {cpus}")),
        _ => Check::warn(
            NAME,
            "no core is isolated",
            "boot with isolcpus=N nohz_full=N rcu_nocbs=N and run the control processes on core N",
        ),
    }
}

fn clock(machine: &Machine) -> Check {
    const NAME: &str = "clock";
    let source = "sys/devices/system/clocksource/clocksource0/current_clocksource";
    match machine.read(source).as_deref() {
        Some(source @ ("tsc" | "kvm-clock" | "arch_sys_counter")) => Check::pass(NAME, source),
        Some(source) => Check::warn(
            NAME,
            format!("{source}: reading it takes microseconds"),
            "boot with clocksource=tsc where the processor has an invariant TSC",
        ),
        None => Check::warn(
            NAME,
            "the clock's source cannot be read",
            "mount /sys so that this user can read it",
        ),
    }
}

fn shared_memory(machine: &Machine) -> Check {
    const NAME: &str = "shared memory";
    let Some(mounts) = machine.read("proc/self/mounts") else {
        return Check::fail(NAME, "/proc/self/mounts cannot be read", "mount /proc");
    };
    let mounted = |line: &str| line.split_whitespace().nth(1) == Some("/dev/shm");
    match mounts.lines().any(mounted) {
        true => Check::pass(NAME, "/dev/shm is mounted"),
        false => Check::fail(
            NAME,
            "/dev/shm is not mounted",
            "mount -t tmpfs -o mode=1777 tmpfs /dev/shm",
        ),
    }
}

fn can(machine: &Machine) -> Check {
    const NAME: &str = "can";
    const NET: &str = "sys/class/net";
    let of_can = |name: &String| machine.number(&format!("{NET}/{name}/type")) == Some(ARPHRD_CAN);
    let interfaces: Vec<_> = machine.list(NET).into_iter().filter(of_can).collect();
    let state = |name: &String| {
        let state = machine.read(&format!("{NET}/{name}/operstate"));
        state.unwrap_or_else(|| "unknown".to_owned())
    };
    // A virtual interface reports no carrier: its state is unknown while it is up.
    let up = |name: &String| matches!(state(name).as_str(), "up" | "unknown");
    let found: Vec<_> = interfaces
        .iter()
        .map(|name| format!("{name} {}", state(name)))
        .collect();
    match interfaces.iter().any(up) {
        true => Check::pass(NAME, found.join(", ")),
        false if found.is_empty() => Check::warn(
            NAME,
            "no CAN interface; the simulator and the emulator need none",
            "load the adapter's driver; `ip link` should list can0",
        ),
        false => Check::warn(
            NAME,
            found.join(", "),
            "ip link set can0 up type can bitrate 1000000",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::path::Path;

    fn machine(files: &[(&str, &str)]) -> (tempfile::TempDir, Machine) {
        let root = tempfile::tempdir().expect("a folder");
        for (file, text) in files {
            let path = root.path().join(file);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, text).expect("written");
        }
        let machine = Machine::new(root.path());
        (root, machine)
    }

    fn verdicts(machine: &Machine) -> Vec<(&'static str, Verdict)> {
        let checks = all(machine);
        for check in &checks {
            let passed = check.verdict == Verdict::Pass;
            assert_eq!(check.remedy.is_none(), passed, "{check}");
        }
        checks.iter().map(|c| (c.name, c.verdict)).collect()
    }

    const LIMITS: &str = "\
Limit                     Soft Limit           Hard Limit           Units
Max locked memory         unlimited            unlimited            bytes
Max realtime priority     90                   90
";

    #[test]
    fn a_prepared_machine_passes_all_checks() {
        let (_root, machine) = machine(&[
            ("proc/sys/kernel/osrelease", "6.12.1-rt\n"),
            ("sys/kernel/realtime", "1\n"),
            ("proc/self/limits", LIMITS),
            ("proc/self/status", "CapEff:\t0000000000000000\n"),
            ("proc/sys/kernel/sched_rt_runtime_us", "-1\n"),
            (
                "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor",
                "performance\n",
            ),
            ("sys/devices/system/cpu/isolated", "1\n"),
            (
                "sys/devices/system/clocksource/clocksource0/current_clocksource",
                "tsc\n",
            ),
            ("proc/self/mounts", "tmpfs /dev/shm tmpfs rw 0 0\n"),
            ("sys/class/net/can0/type", "280\n"),
            ("sys/class/net/can0/operstate", "up\n"),
            ("sys/class/net/eth0/type", "1\n"),
        ]);
        for (name, verdict) in verdicts(&machine) {
            assert_eq!(verdict, Verdict::Pass, "{name}");
        }
    }

    #[test]
    fn an_unprepared_machine_gets_a_remedy_for_each_failed_check() {
        let (_root, machine) = machine(&[
            ("proc/sys/kernel/osrelease", "6.12.1\n"),
            (
                "proc/self/limits",
                "Max locked memory         8388608              8388608              bytes\n\
                 Max realtime priority     0                    0\n",
            ),
            ("proc/self/status", "CapEff:\t0000000000000000\n"),
            ("proc/sys/kernel/sched_rt_runtime_us", "950000\n"),
            (
                "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor",
                "powersave\n",
            ),
            ("sys/devices/system/cpu/isolated", "\n"),
            (
                "sys/devices/system/clocksource/clocksource0/current_clocksource",
                "hpet\n",
            ),
            ("proc/self/mounts", "tmpfs /dev/shm tmpfs rw 0 0\n"),
            ("sys/class/net/can0/type", "280\n"),
            ("sys/class/net/can0/operstate", "down\n"),
        ]);
        let expected = [
            ("kernel", Verdict::Warn),
            ("priority", Verdict::Fail),
            ("throttling", Verdict::Pass),
            ("memlock", Verdict::Fail),
            ("governor", Verdict::Warn),
            ("isolation", Verdict::Warn),
            ("clock", Verdict::Warn),
            ("shared memory", Verdict::Pass),
            ("can", Verdict::Warn),
        ];
        assert_eq!(verdicts(&machine), expected);
    }

    #[test]
    fn capabilities_replace_limits() {
        let mask = (1_u64 << CAP_IPC_LOCK) | (1 << CAP_SYS_NICE);
        let status = format!("Name:\tsupple\nCapEff:\t{mask:016x}\n");
        let (_root, machine) = machine(&[("proc/self/status", &status)]);
        assert_eq!(priority(&machine).verdict, Verdict::Pass);
        assert_eq!(memory_lock(&machine).verdict, Verdict::Pass);
        assert!(!machine.has_capability(0));
    }

    #[test]
    fn a_machine_without_readable_files_is_not_ready() {
        let machine = Machine::new(Path::new("/no/such/machine"));
        let verdicts = verdicts(&machine);
        assert!(
            verdicts.iter().all(|(_, v)| *v != Verdict::Pass),
            "{verdicts:?}"
        );
    }
}
