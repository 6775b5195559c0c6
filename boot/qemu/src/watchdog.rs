//! Decides when a wait has lasted too long, on a machine that may be busy with other work.
//!
//! A limit in wall time fails in two ways. On a busy host, a healthy boot can need ten times its usual time,
//! and a limit that allows for this delays the report of every real hang. QEMU's processor time distinguishes
//! three cases. A kernel that spins uses up its limit. A kernel that has stopped, or never started, uses
//! almost no processor time. A kernel that shares the processor uses what it gets and waits for the rest.
//! Linux counts that waiting time as well, so a starved QEMU is not mistaken for an idle QEMU.

use std::time::{Duration, Instant};

use rustix::process::Pid;

/// Checks for idleness per limit. The interval between two checks must be long enough to measure.
const CHECKS_PER_LIMIT: u32 = 2;
/// QEMU is idle if it uses or waits for less than this share of one processor. A stopped machine used 1.3 %
/// (its timers). Processor time alone does not suffice: beside thirty busy processes on two cores a booting
/// machine used less than 4 % for 10 s, because its threads wait for each other at every sector.
const IDLE_PERCENT: u32 = 4;
/// Ceiling of every wait: this many limits of wall time.
const CEILING: u32 = 15;

/// A wait for one thing, with its limit.
#[derive(Debug)]
pub struct Watchdog {
    process: Pid,
    limit: Duration,
    began: Instant,
    used: Duration,
    /// When idleness was last checked, and the total time used or waited for until then.
    checked: (Instant, Duration),
}

impl Watchdog {
    /// Starts a wait that is over when QEMU has used `limit` of processor time, or is idle after `limit` of
    /// wall time.
    pub fn new(process: Pid, limit: Duration) -> Self {
        let (now, used) = (Instant::now(), processor_time(process));
        Self {
            process,
            limit,
            began: now,
            used,
            checked: (now, used + starved_time(process)),
        }
    }

    /// Starts the wait again, from now.
    pub fn renew(&mut self) {
        *self = Self::new(self.process, self.limit);
    }

    /// Returns whether the wall time has reached the ceiling, whatever QEMU does meanwhile.
    pub fn is_past_ceiling(&self) -> bool {
        self.began.elapsed() >= self.limit * CEILING
    }

    /// Returns whether the wait is over.
    pub fn is_over(&mut self) -> bool {
        // For a process that has just ended this is zero, less than before: hence the saturating
        // subtractions.
        let (now, used) = (Instant::now(), processor_time(self.process));
        let (since, before) = self.checked;
        let mut idle = false;
        if now - since >= self.limit / CHECKS_PER_LIMIT {
            let wanted = used + starved_time(self.process);
            idle = wanted.saturating_sub(before) * 100 < (now - since) * IDLE_PERCENT;
            self.checked = (now, wanted);
        }
        let waited = now - self.began;
        used.saturating_sub(self.used) >= self.limit
            || (idle && waited >= self.limit)
            || self.is_past_ceiling()
    }
}

/// Returns the processor time that a process has used. It is zero for a process that has ended, and on any
/// system except Linux, the only system that reports it in this way: then wall time decides.
fn processor_time(process: Pid) -> Duration {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.as_raw_nonzero()));
    // The second field is the program's name in parentheses, and the name may contain any character.
    let fields = stat.as_deref().ok().and_then(|stat| stat.rsplit_once(')'));
    let mut fields = fields
        .map_or("", |(_, fields)| fields)
        .split_whitespace()
        .skip(11);
    let mut ticks = || fields.next()?.parse::<u64>().ok();
    let all = ticks().unwrap_or(0) + ticks().unwrap_or(0);
    Duration::from_millis(all * 1000 / rustix::param::clock_ticks_per_second().max(1))
}

/// Returns how long the threads of a process were ready to run and had no processor; zero if the system does
/// not count it.
pub fn starved_time(process: Pid) -> Duration {
    let tasks = std::fs::read_dir(format!("/proc/{}/task", process.as_raw_nonzero()));
    let delays = tasks.into_iter().flatten().flatten().filter_map(|task| {
        let counted = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        counted.split_whitespace().nth(1)?.parse::<u64>().ok()
    });
    Duration::from_nanos(delays.sum())
}

#[cfg(test)]
mod tests {
    use std::process::{Child, Command};

    use super::*;

    /// Processes that are killed when the test ends, also if it fails.
    struct BusyProcesses(Vec<Child>);

    impl Drop for BusyProcesses {
        fn drop(&mut self) {
            for child in &mut self.0 {
                let _ = child.kill();
                let _ = child.wait();
            }
        }
    }

    /// Two busy processes for each processor: all of them have to wait. Threads of this process would not
    /// work: the test harness ends threads meanwhile, and a thread that has ended is no longer counted.
    #[test]
    fn a_process_without_a_processor_counts_as_starved() {
        let count = 2 * std::thread::available_parallelism().unwrap().get();
        let busy = || {
            let mut shell = Command::new("sh");
            shell.args(["-c", "while :; do :; done"]).spawn().unwrap()
        };
        let busy = BusyProcesses((0..count).map(|_| busy()).collect());
        let begun = Instant::now();
        let is_starved =
            |child: &Child| starved_time(Pid::from_child(child)) > Duration::from_millis(50);
        while !busy.0.iter().any(is_starved) {
            assert!(
                begun.elapsed() < Duration::from_secs(20),
                "no process waited for a processor"
            );
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    #[test]
    fn a_busy_process_uses_processor_time() {
        let this = rustix::process::getpid();
        let before = processor_time(this);
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_millis(300) {
            std::hint::spin_loop();
        }
        assert!(processor_time(this) > before);
        assert_eq!(
            processor_time(Pid::from_raw(i32::MAX).unwrap()),
            Duration::ZERO
        );
    }

    #[test]
    fn a_busy_process_reaches_its_limit() {
        let mut watchdog = Watchdog::new(rustix::process::getpid(), Duration::from_millis(200));
        assert!(!watchdog.is_over());
        let begun = Instant::now();
        while !watchdog.is_over() {
            assert!(begun.elapsed() < Duration::from_secs(20));
        }
        assert!(begun.elapsed() >= Duration::from_millis(90));
        watchdog.renew();
        assert!(!watchdog.is_over());
    }

    #[test]
    fn the_wait_for_an_ended_process_lasts_its_limit_of_wall_time() {
        let mut child = Command::new("sh")
            .args([
                "-c",
                "i=0; while [ $i -lt 100000 ]; do i=$((i + 1)); done; read line",
            ])
            .stdin(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        let process = Pid::from_child(&child);
        while processor_time(process).is_zero() {
            std::thread::yield_now();
        }
        let mut watchdog = Watchdog::new(process, Duration::from_secs(60));
        drop(child.stdin.take());
        child.wait().unwrap();
        assert!(!watchdog.is_over());
    }
}
