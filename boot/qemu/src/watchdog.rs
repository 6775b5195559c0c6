//! How long is too long, on a machine that may be busy with other things.
//!
//! A limit in wall time is wrong twice: beside other work a sound boot can take ten times its
//! usual time, and a limit wide enough for that makes every real hang wait for it. QEMU's own
//! processor time tells the two apart. A kernel that spins uses it up; one that has stopped, or
//! never came, uses next to none of it; and one that only has to share the processor uses what
//! it gets, and waits for the rest: Linux counts that wait, too, so a QEMU that is starved is not
//! taken for one that idles.

use std::time::{Duration, Instant};

use rustix::process::Pid;

/// Looks at whether QEMU idles within a limit: each look is long enough to tell.
const LOOKS: u32 = 2;
/// Idle: less than this of one processor, used or waited for. A stopped machine was seen to use
/// 1.3 % (its timers). One that boots beside thirty busy processes on two cores used less than 4 %
/// for 10 s: its threads wait for each other at every sector.
const IDLE_PERCENT: u32 = 4;
/// Wall time beyond which nothing is waited for, in limits.
const AT_MOST: u32 = 15;

/// Waiting for one thing.
#[derive(Debug)]
pub struct Watchdog {
    process: Pid,
    limit: Duration,
    began: Instant,
    used: Duration,
    /// The last look at whether QEMU idles, and the time used or waited for until then.
    looked: (Instant, Duration),
}

impl Watchdog {
    /// Waits until QEMU has worked for `limit`, or has idled when `limit` has passed.
    pub fn new(process: Pid, limit: Duration) -> Self {
        let (now, used) = (Instant::now(), processor_time(process));
        Self {
            process,
            limit,
            began: now,
            used,
            looked: (now, used + starved_time(process)),
        }
    }

    /// Begins anew.
    pub fn renew(&mut self) {
        *self = Self::new(self.process, self.limit);
    }

    /// Whether it is over by the clock, whatever QEMU does meanwhile.
    pub fn is_past_ceiling(&self) -> bool {
        self.began.elapsed() >= self.limit * AT_MOST
    }

    /// Whether it is over.
    pub fn is_over(&mut self) -> bool {
        // A process that has just ended has used less than before: none.
        let (now, used) = (Instant::now(), processor_time(self.process));
        let (since, before) = self.looked;
        let mut idle = false;
        if now - since >= self.limit / LOOKS {
            let wanted = used + starved_time(self.process);
            idle = wanted.saturating_sub(before) * 100 < (now - since) * IDLE_PERCENT;
            self.looked = (now, wanted);
        }
        let waited = now - self.began;
        used.saturating_sub(self.used) >= self.limit
            || (idle && waited >= self.limit)
            || self.is_past_ceiling()
    }
}

/// The processor time that a process has used; for one that has ended, and where the system does
/// not tell (only Linux does, in this way), none: then wall time decides.
fn processor_time(process: Pid) -> Duration {
    let told = std::fs::read_to_string(format!("/proc/{}/stat", process.as_raw_nonzero()));
    // The second field is the program's name, in parentheses, with anything in it.
    let fields = told.as_deref().ok().and_then(|stat| stat.rsplit_once(')'));
    let mut fields = fields
        .map_or("", |(_, fields)| fields)
        .split_whitespace()
        .skip(11);
    let mut ticks = || fields.next()?.parse::<u64>().ok();
    let all = ticks().unwrap_or(0) + ticks().unwrap_or(0);
    Duration::from_millis(all * 1000 / rustix::param::clock_ticks_per_second().max(1))
}

/// Returns how long the threads of a process were ready to run and had no processor; zero if the system
/// does not count it.
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
    use super::*;

    /// Two busy threads for each processor: all of them wait.
    #[test]
    fn a_starved_process_is_seen_to_wait() {
        let own = rustix::process::getpid();
        let before = starved_time(own);
        let threads = 2 * std::thread::available_parallelism().unwrap().get();
        let by = Instant::now() + Duration::from_millis(500);
        std::thread::scope(|scope| {
            let busy: Vec<_> = (0..threads)
                .map(|_| {
                    scope.spawn(|| {
                        while Instant::now() < by {
                            std::hint::spin_loop();
                        }
                    })
                })
                .collect();
            // While they live: a thread that has ended is not counted.
            while busy.iter().all(|thread| !thread.is_finished()) {
                if starved_time(own) - before > Duration::from_millis(50) {
                    return;
                }
                std::thread::sleep(Duration::from_millis(5));
            }
            panic!("nothing waited");
        });
    }

    #[test]
    fn a_process_that_works_uses_time() {
        let own = rustix::process::getpid();
        let before = processor_time(own);
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_millis(300) {
            std::hint::spin_loop();
        }
        assert!(processor_time(own) > before);
        assert_eq!(
            processor_time(Pid::from_raw(i32::MAX).unwrap()),
            Duration::ZERO
        );
    }

    #[test]
    fn work_uses_watchdog_up() {
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
    fn a_process_that_ended_meanwhile_is_waited_for_by_the_clock() {
        let mut child = std::process::Command::new("sh")
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
